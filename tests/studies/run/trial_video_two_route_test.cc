// The film is decoded again by ffmpeg and compared with what went in.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "experiments/media/mp4_writer.h"
#include "experiments/studies/run/trial_video.h"
#include "experiments/system/subprocess.h"
#include "sim/base/random.h"
#include "tests/studies/run/synthetic_trial.h"

namespace turbidock::run {
namespace {

constexpr int kFrames = 6;
// Mean difference of a channel value: the made-up noise is 2 DN, measured 2.1 to 2.3.
constexpr double kEncodingLoss_dn = 4;

std::string FileBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// All frames of the file as raw pixels.
std::string Decode(const std::string& path, const std::string& pixel_format) {
  system::Subprocess ffmpeg({"ffmpeg", "-nostdin", "-loglevel", "error", "-i", path, "-f",
                             "rawvideo", "-pix_fmt", pixel_format, "pipe:1"},
                            "ffmpeg");
  return ffmpeg.Finish();
}

// Writes a short film and returns the pictures that went in.
std::vector<Image3u8> WriteFilm(const std::string& path) {
  const trial::TrialLog log = testing::SyntheticTrial(1);
  Rng rng = SeedTree(5).Stream("film");
  VideoComposer composer({});
  media::Mp4Writer writer(path, kVideoWidth, kVideoHeight, 30);
  std::vector<Image3u8> pictures;
  for (int i = 0; i < kFrames; ++i) {
    const trial::FrameRecord& record = log.frames[static_cast<size_t>(i)];
    const Stereo<std::vector<vision::ProjectedBall>> balls = {
        testing::SyntheticBalls(record.true_X_HM, true),
        testing::SyntheticBalls(record.true_X_HM, false)};
    const StereoImage images{{testing::SyntheticImage(balls.left, 60, &rng),
                              testing::SyntheticImage(balls.right, 60, &rng)}};
    const media::Canvas& canvas = composer.Compose({images, balls, record});
    pictures.push_back(canvas.ToImage());
    writer.Add(canvas);
  }
  writer.Finish();
  return pictures;
}

TEST(Video, DecodesToWhatWentIn) {
  const std::string path = ::testing::TempDir() + "/decoded.mp4";
  const std::vector<Image3u8> sent = WriteFilm(path);
  const std::string decoded = Decode(path, "rgb24");
  const size_t frame_bytes = 3 * static_cast<size_t>(kVideoWidth) * kVideoHeight;
  ASSERT_EQ(decoded.size(), kFrames * frame_bytes);
  for (size_t k = 0; k < kFrames; ++k) {
    double error_dn = 0;
    for (size_t i = 0; i < frame_bytes; ++i) {
      const int back = static_cast<uint8_t>(decoded[k * frame_bytes + i]);
      error_dn += std::abs(back - sent[k].data()[i]) / static_cast<double>(frame_bytes);
    }
    // the noise that x264 drops; two frames further on, the picture differs more
    EXPECT_LT(error_dn, kEncodingLoss_dn) << k;
    EXPECT_GT(error_dn, 0.01) << k;
  }
}

// Range and matrix of the colours: wrong ones move these patches by 10 DN and more.
TEST(Video, ColorsComeBack) {
  const Rgb patches[] = {{220, 30, 30}, {20, 200, 40}, {40, 60, 230}, {240, 240, 240}};
  media::Canvas canvas(64, 64);
  for (int i = 0; i < 4; ++i) canvas.FillRect({32 * (i % 2), 32 * (i / 2), 32, 32}, patches[i]);
  const std::string path = ::testing::TempDir() + "/colors.mp4";
  media::Mp4Writer writer(path, 64, 64, 30);
  writer.Add(canvas);
  writer.Finish();
  const std::string decoded = Decode(path, "rgb24");
  ASSERT_EQ(decoded.size(), 3u * 64 * 64);
  for (size_t i = 0; i < 4; ++i) {
    const size_t at = 3 * (64 * (16 + 32 * (i / 2)) + 16 + 32 * (i % 2));
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(static_cast<uint8_t>(decoded[at + c]), patches[i][c], 4) << i << " " << c;
  }
}

// What browsers ask for: H.264 High (4:2:0, 8 bits) with the index in front of the pictures.
TEST(Video, FileIsWhatBrowsersPlay) {
  const std::string path = ::testing::TempDir() + "/browser.mp4";
  WriteFilm(path);
  const std::string bytes = FileBytes(path);
  EXPECT_GT(bytes.size(), 10000u);
  const size_t index = bytes.find("moov"), pictures = bytes.find("mdat");
  ASSERT_NE(index, std::string::npos);
  ASSERT_NE(pictures, std::string::npos);
  EXPECT_LT(index, pictures);
  const size_t settings = bytes.find("avcC");
  ASSERT_NE(settings, std::string::npos);
  EXPECT_EQ(bytes[settings + 5], 100);  // profile_idc of High
}

TEST(Video, SameFramesGiveTheSameBytes) {
  const std::string a = ::testing::TempDir() + "/a.mp4", b = ::testing::TempDir() + "/b.mp4";
  WriteFilm(a);
  WriteFilm(b);
  EXPECT_TRUE(FileBytes(a) == FileBytes(b));
}

// What stood there stays.
TEST(Video, WithoutFinishThereIsNone) {
  const std::string path = ::testing::TempDir() + "/broken_off.mp4";
  std::ofstream(path) << "an older film";
  {
    media::Mp4Writer writer(path, 64, 48, 30);
    for (int i = 0; i < 5; ++i) writer.Add(media::Canvas(64, 48));
  }
  EXPECT_EQ(FileBytes(path), "an older film");
}

}  // namespace
}  // namespace turbidock::run
