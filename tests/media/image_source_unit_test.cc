// Which files a name of images means, and in which order.

#include "experiments/media/image_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace turbidock::media {
namespace {

using ::testing::ElementsAre;

TEST(FilesOf, AreInTheOrderOfTheirNumbers) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / "turbidock_files_of";
  std::filesystem::create_directories(folder);
  const auto path = [&](const std::string& name) { return (folder / name).string(); };
  for (const char* name :
       {"a10.png", "a2.png", "a1.png", "b009.png", "b010.png", "b100.png", "notes.txt"})
    std::ofstream{path(name)};
  EXPECT_THAT(FilesOf(path("a*.png")),
              ElementsAre(path("a1.png"), path("a2.png"), path("a10.png")));
  EXPECT_THAT(FilesOf(path("b*")),
              ElementsAre(path("b009.png"), path("b010.png"), path("b100.png")));
  EXPECT_EQ(FilesOf(folder.string()).size(), 6u);  // images only
  EXPECT_THAT(FilesOf(path("notes.txt")), ElementsAre(path("notes.txt")));
  EXPECT_THAT(FilesOf(path("c*.png")), ElementsAre());
  EXPECT_THAT(FilesOf(path("c.png")), ElementsAre());
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace turbidock::media
