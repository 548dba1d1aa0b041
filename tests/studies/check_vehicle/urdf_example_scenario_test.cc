// The example in models/README.md, from a URDF to docking, as it stands there.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "experiments/config/data_files.h"
#include "experiments/system/output_path.h"
#include "tests/support/program.h"

namespace turbidock::check_vehicle {
namespace {

namespace fs = std::filesystem;

TEST(UrdfExample, DocksAsTheReadmeHasIt) {
  const std::string readme = system::ReadWhole(config::ModelPath("README.md"));
  const size_t begin = readme.find("```sh\n", readme.find("**I have a URDF.**")) + 6;
  const std::string block = readme.substr(begin, readme.find("```", begin) - begin);
  ASSERT_NE(block.find("--expect success"), std::string::npos) << block;
  const fs::path folder = fs::path(::testing::TempDir()) / "urdf_example";
  fs::remove_all(folder);
  fs::create_directories(folder / "assets");
  fs::copy(config::AssetPath("urdf"), folder / "assets/urdf", fs::copy_options::recursive);
  std::ofstream(folder / "example.sh") << "set -e\n" << block;
  const std::string command = "cd '" + folder.string() + "' && PATH='" +
                              fs::path(testing::ProgramPath()).parent_path().string() +
                              "':$PATH bash example.sh >said.txt 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << system::ReadWhole(folder / "said.txt");
  EXPECT_NE(system::ReadWhole(folder / "said.txt").find("20 kg"), std::string::npos);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace turbidock::check_vehicle
