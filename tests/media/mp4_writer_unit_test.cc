#include "experiments/media/mp4_writer.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

namespace turbidock::media {
namespace {

// Turbid water is noise, which would take 10 MB in these four seconds.
TEST(Mp4Writer, NoiseTakesNoMoreThanItsRate) {
  const std::string path = ::testing::TempDir() + "/noise.mp4";
  Mp4Writer film(path, 640, 360, 30);
  Canvas canvas(640, 360);
  Image3u8 noise(640, 360);
  std::minstd_rand random(1);
  for (int frame = 0; frame < 120; ++frame) {
    for (size_t i = 0; i < 3 * noise.pixels(); ++i)
      noise.data()[i] = static_cast<uint8_t>(random() >> 8 & 255);
    canvas.DrawImage(noise, canvas.area());
    film.Add(canvas);
  }
  film.Finish();
  EXPECT_LT(std::filesystem::file_size(path), 1'200'000u);  // the first picture is large
}

}  // namespace
}  // namespace turbidock::media
