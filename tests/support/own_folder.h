#pragma once
// A folder that a test has to itself: made before it, gone after it.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace turbidock::testing {

// All bytes of a file; none where there is no file.
inline std::string TextOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class OwnFolder : public ::testing::Test {
 public:
  OwnFolder() { std::filesystem::create_directories(folder_); }
  ~OwnFolder() override { std::filesystem::remove_all(folder_); }

  // The path of a file in it, which is written first where a text is given.
  std::string File(const std::string& name) const { return (folder_ / name).string(); }
  std::string File(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return File(name);
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() /
      ("turbidock_" + std::to_string(getpid()) + "_" +
       ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

}  // namespace turbidock::testing
