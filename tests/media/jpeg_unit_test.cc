#include "experiments/media/jpeg.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "experiments/media/image_source.h"

namespace turbidock::media {
namespace {

Image3u8 Ramp(int width, int height) {
  Image3u8 image(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      image.at(u, v)[0] = static_cast<uint8_t>(255 * u / width);
      image.at(u, v)[1] = static_cast<uint8_t>(255 * v / height);
      image.at(u, v)[2] = 40;
    }
  return image;
}

TEST(Jpeg, ComesBackNearlyAsItWas) {
  const Image3u8 image = Ramp(64, 48);
  const std::string path = ::testing::TempDir() + "/ramp.jpg";
  std::ofstream(path, std::ios::binary) << EncodeJpeg(image, 95);
  Image3u8 back;
  ASSERT_TRUE(OpenImages(path)->Next(&back));
  ASSERT_EQ(back.width(), 64);
  ASSERT_EQ(back.height(), 48);
  int worst = 0;
  for (size_t i = 0; i < 3 * image.pixels(); ++i)
    worst = std::max(worst, std::abs(image.data()[i] - back.data()[i]));
  EXPECT_LE(worst, 12);
  EXPECT_GT(EncodeJpeg(image, 95).size(), EncodeJpeg(image, 30).size());
}

}  // namespace
}  // namespace turbidock::media
