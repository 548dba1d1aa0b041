#include "experiments/media/png.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "experiments/system/output_path.h"
#include "sim/base/check.h"
#include "sim/base/random.h"
#include "tests/support/message_of.h"

namespace turbidock::media {
namespace {

using ::testing::HasSubstr;
using testing::MessageOf;

std::string Fresh(const std::string& name) {
  const std::string path = ::testing::TempDir() + "/" + name;
  std::filesystem::remove_all(path);
  return path;
}

TEST(Png, ComesBackAsItWas) {
  const std::string path = Fresh("round_trip.png");
  Rng rng = SeedTree(3).Stream("png");
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(7, 3), std::pair(641, 2)}) {
    Image3u8 image(width, height);
    for (size_t i = 0; i < 3 * image.pixels(); ++i)
      image.data()[i] = static_cast<uint8_t>(rng.NextU32());
    WritePng(path, image);
    EXPECT_TRUE(ReadPng(path) == image) << width << " x " << height;
  }
}

// Signature, then the header chunk: width and height as big-endian words, depth 8, colour type 2
// (RGB).
TEST(Png, FileIsWhatTheFormatSays) {
  const std::string path = Fresh("header.png");
  WritePng(path, Image3u8(258, 3, 9));
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  ASSERT_GT(bytes.size(), 26u);
  EXPECT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(bytes.substr(12, 14), std::string("IHDR\0\0\1\2\0\0\0\3\x08\x02", 14));
}

TEST(Png, ReadingNamesTheFile) {
  const std::string missing = Fresh("missing.png");
  EXPECT_THAT(MessageOf([&] { ReadPng(missing); }), HasSubstr(missing));
  const std::string text = Fresh("text.png");
  std::ofstream(text) << "not a picture";
  EXPECT_THAT(MessageOf([&] { ReadPng(text); }), HasSubstr(text));
  const std::string empty = Fresh("empty.png");
  std::ofstream{empty};
  EXPECT_EQ(MessageOf([&] { ReadPng(empty); }), empty + ": is empty");
}

TEST(Png, TruncatedFileIsAnError) {
  const std::string path = Fresh("truncated.png");
  Image3u8 image(64, 64);
  for (size_t i = 0; i < 3 * image.pixels(); ++i)
    image.data()[i] = static_cast<uint8_t>(i * i >> 3);
  WritePng(path, image);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_THAT(MessageOf([&] { ReadPng(path); }), HasSubstr(path));
}

// A header costs nothing to write: what it promises is not allocated.
TEST(Png, AHeaderOfAHugeImageIsRefused) {
  const std::string path = Fresh("huge.png");
  WritePng(path, Image3u8(8, 8, 9));
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  std::string header(29, '\0');  // signature, then length, name, 13 bytes
  file.read(header.data(), 29);
  header[18] = header[22] = '\x75';  // 30,000 = 0x7530
  header[19] = header[23] = '\x30';
  uint32_t crc = 0xffffffff;
  for (int i = 12; i < 29; ++i) {
    crc ^= static_cast<unsigned char>(header[static_cast<size_t>(i)]);
    for (int k = 0; k < 8; ++k) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
  }
  crc = ~crc;
  file.seekp(0);
  file << header;
  for (int shift = 24; shift >= 0; shift -= 8) file << static_cast<char>(crc >> shift & 0xff);
  file.close();
  EXPECT_EQ(MessageOf([&] { ReadPng(path); }),
            path + ": 30000 x 30000 pixels, at most 8192 x 8192 can be read");
}

TEST(Png, SizesOfImagesAreBounded) {
  RequireImageSize(1, 1, "a");
  RequireImageSize(8192, 8192, "a");
  for (const auto& [width, height] :
       {std::pair<int64_t, int64_t>{0, 8}, {8, 0}, {8193, 8}, {8, 8193}, {int64_t{1} << 40, 1}})
    EXPECT_THROW(RequireImageSize(width, height, "a"), ConfigError) << width << " x " << height;
}

TEST(Png, APipeIsNoImage) {
  const std::string path = Fresh("pipe.png");
  ASSERT_EQ(mkfifo(path.c_str(), 0666), 0);
  EXPECT_THAT(MessageOf([&] { ReadPng(path); }), HasSubstr("no regular file"));
}

TEST(OutputPath, UnwritablePlacesAreConfigErrors) {
  const std::string no_folder = Fresh("no_folder");
  std::ofstream(no_folder) << "a file";
  EXPECT_EQ(MessageOf([&] { WritePng(no_folder + "/image.png", Image3u8(2, 2)); }),
            no_folder + ": cannot be made: Not a directory");
  EXPECT_THAT(MessageOf([&] { system::RequireWritable(::testing::TempDir()); }),
              HasSubstr("cannot be written"));
}

TEST(OutputPath, AskingLeavesNoTrace) {
  const std::string path = Fresh("asked.txt");
  system::RequireWritable(path);
  EXPECT_FALSE(std::filesystem::exists(path));
  std::ofstream(path) << "kept";
  system::RequireWritable(path);
  EXPECT_EQ(std::filesystem::file_size(path), 4u);
}

}  // namespace
}  // namespace turbidock::media
