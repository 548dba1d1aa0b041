#include "experiments/studies/run/trial_video.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "experiments/media/mp4_writer.h"
#include "experiments/trial/trial.h"
#include "tests/studies/run/synthetic_trial.h"

namespace turbidock::run {
namespace {

using ::testing::HasSubstr;
using vision::ProjectedBall;

const Stereo<std::vector<ProjectedBall>> kNone;

trial::FrameRecord Record(double time_s, double fitness) {
  trial::FrameRecord record;
  record.time_s = time_s;
  record.fitness = fitness;
  record.true_X_HM.p = record.true_at_image_X_HM.p = record.est_X_HM.p = {0.6, 0.01, -0.02};
  return record;
}

// A pair of images whose pixels tell where they come from.
StereoImage Gradients(int width, int height) {
  StereoImage images{{Image3u8(width, height), Image3u8(width, height)}};
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const uint8_t left[] = {static_cast<uint8_t>(u), static_cast<uint8_t>(v), 40};
      const uint8_t right[] = {90, static_cast<uint8_t>(u + v), static_cast<uint8_t>(u)};
      std::copy_n(left, 3, images.left.at(u, v));
      std::copy_n(right, 3, images.right.at(u, v));
    }
  }
  return images;
}

int Difference(const uint8_t* a, const std::array<int, 3>& b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

TEST(VideoComposer, ShowsBothCamerasPixelByPixel) {
  VideoComposer composer({});
  const StereoImage images = Gradients(640, 480);
  const Image3u8 picture = composer.Compose({images, kNone, Record(0, 0.8)}).ToImage();
  ASSERT_EQ(picture.width(), 1280);
  ASSERT_EQ(picture.height(), 720);
  // away from the words at the upper and lower edge and from the seam in the middle
  for (int v = 40; v < 440; ++v) {
    for (int u = 2; u < 638; ++u) {
      for (int c = 0; c < 3; ++c) {
        ASSERT_EQ(picture.at(u, v)[c], images.left.at(u, v)[c]) << u << "," << v;
        ASSERT_EQ(picture.at(u + 640, v)[c], images.right.at(u, v)[c]) << u << "," << v;
      }
    }
  }
}

TEST(VideoComposer, DotsHaveTheBallsColorOnItsCircle) {
  StereoImage images{{Image3u8(640, 480, 0), Image3u8(640, 480, 255)}};
  const std::vector<ProjectedBall> left = {{{300, 200}, 40, {255, 0, 0}}};
  const std::vector<ProjectedBall> right = {{{100, 250}, 60, {0, 0, 255}}};
  VideoComposer composer({});
  const Image3u8 picture = composer.Compose({images, {left, right}, Record(0, 0.8)}).ToImage();
  // the first dot is to the right of the centre
  EXPECT_LE(Difference(picture.at(340, 200), {255, 0, 0}), 8);
  EXPECT_LE(Difference(picture.at(640 + 160, 250), {0, 0, 255}), 8);
  // the envelope: white, with black beside it that shows on white ground
  EXPECT_GT(picture.at(300, 200 + 56)[0], 150);
  EXPECT_LT(picture.at(640 + 100, 250 - 85)[0] + picture.at(640 + 100, 250 - 83)[0], 440);
  // inside and outside, the image itself
  EXPECT_LE(Difference(picture.at(300, 200), {0, 0, 0}), 0);
  EXPECT_LE(Difference(picture.at(640 + 100, 350), {255, 255, 255}), 0);
}

TEST(VideoComposer, UndetectedMarkerIsDrawnFaintly) {
  StereoImage images{{Image3u8(640, 480, 0), Image3u8(640, 480, 0)}};
  const std::vector<ProjectedBall> balls = {{{300, 200}, 40, {255, 0, 0}}};
  const auto red = [&](double fitness) {
    VideoComposer composer({});
    return composer.Compose({images, {balls, balls}, Record(0, fitness)}).ToImage().at(340, 200)[0];
  };
  EXPECT_GT(red(0.22), 250);
  EXPECT_LT(red(0.21), 200);
}

// A ball that cannot be drawn is left out, and one beyond the edge does not reach the other camera.
TEST(VideoComposer, CirclesStayInTheirImage) {
  StereoImage images{{Image3u8(640, 480, 0), Image3u8(640, 480, 0)}};
  const std::vector<ProjectedBall> right = {
      {{0, 200}, 80, {255, 0, 0}}, {{NAN, 200}, 30, {255, 0, 0}}, {{200, 200}, 0, {255, 0, 0}}};
  VideoComposer composer({});
  const Image3u8 picture = composer.Compose({images, {{}, right}, Record(0, 0.8)}).ToImage();
  for (int v = 40; v < 440; ++v)
    for (int u = 400; u < 639; ++u) ASSERT_EQ(picture.at(u, v)[0], 0) << u << "," << v;
  EXPECT_EQ(picture.at(840, 200)[0], 0);
  EXPECT_GT(picture.at(720, 200)[0], 200);  // and the part that is inside is drawn
}

// Images of half the size fill the same panel; pixel (u, v) covers 2 x 2 pixels of the film.
TEST(VideoComposer, OtherImageSizesAreScaledWithTheirCircles) {
  StereoImage images{{Image3u8(320, 240, 0), Image3u8(320, 240, 0)}};
  const std::vector<ProjectedBall> balls = {{{100, 120}, 30, {255, 0, 0}}};
  VideoComposer composer({});
  const Image3u8 picture = composer.Compose({images, {balls, {}}, Record(0, 0.8)}).ToImage();
  // centre (2 * 100.5 - 0.5, 2 * 120.5 - 0.5), radius 60
  EXPECT_LE(Difference(picture.at(260, 240), {255, 0, 0}), 40);
  EXPECT_LE(Difference(picture.at(261, 241), {255, 0, 0}), 40);
}

TEST(VideoComposer, TheViewFromOutsideIsBesideTheCharts) {
  const StereoImage images = Gradients(640, 480);
  Image3u8 spectator(320, 240);
  for (size_t i = 0; i < spectator.pixels(); ++i) spectator.data()[3 * i] = 200;
  VideoComposer with({}), without({});
  const Image3u8 a = with.Compose({images, kNone, Record(0, 0.8), &spectator}).ToImage();
  const Image3u8 b = without.Compose({images, kNone, Record(0, 0.8)}).ToImage();
  EXPECT_EQ(a.at(160, 600)[0], 200);
  EXPECT_EQ(a.at(318, 718)[0], 200);
  EXPECT_LT(a.at(322, 600)[0], 60);
  EXPECT_LT(b.at(160, 600)[0], 60);
}

// The chart of F: a constant F leaves a line of the estimate's colour at one row of the film, and
// two values are as far apart as their share of the range.
TEST(VideoComposer, FitnessRunsAtItsHeight) {
  const StereoImage images{{Image3u8(640, 480), Image3u8(640, 480)}};
  const auto row_of = [&](double fitness) {
    VideoComposer composer({});
    const media::Canvas* canvas = nullptr;
    for (int i = 0; i < 300; ++i)
      canvas = &composer.Compose({images, kNone, Record(0.03 * i, fitness)});
    const Image3u8 picture = canvas->ToImage();
    double weight = 0, moment = 0;
    for (int v = 520; v < 596; ++v) {
      const uint8_t* p = picture.at(430, v);
      const double blue = p[2] - p[0] - 40.0;
      if (blue <= 0) continue;
      weight += blue;
      moment += blue * v;
    }
    return moment / weight;
  };
  const double low = row_of(0.0), middle = row_of(0.4), high = row_of(0.8);
  EXPECT_NEAR(low - middle, middle - high, 1.0);
  // the range of F, half as much again, over the plot of the upper chart
  EXPECT_NEAR(low - high, 0.8 / (1.5 * 1.27) * 73, 3);
}

// The pixels that differ between two pictures, in columns and rows from there to there.
int Differing(const Image3u8& a, const Image3u8& b, const media::PixelRect& in) {
  int count = 0;
  for (int v = in.y; v < in.bottom(); ++v)
    for (int u = in.x; u < in.right(); ++u)
      count += !std::equal(a.at(u, v), a.at(u, v) + 3, b.at(u, v));
  return count;
}

TEST(VideoComposer, SaysWhatItIsOfAndHowItEnded) {
  const StereoImage images{{Image3u8(640, 480), Image3u8(640, 480)}};
  trial::Scenario scenario;
  VideoComposer plain(scenario);
  scenario.description = "night sea";
  scenario.seed = 7;
  VideoComposer titled(scenario);
  const Image3u8 a = plain.Compose({images, kNone, Record(0, 0.8)}).ToImage();
  const Image3u8 b = titled.Compose({images, kNone, Record(0, 0.8)}).ToImage();
  EXPECT_GT(Differing(a, b, {650, 10, 200, 24}), 300);
  int written = 0;
  for (int u = 650; u < 850; ++u)
    for (int v = 10; v < 34; ++v) written += b.at(u, v)[0] > 150 && a.at(u, v)[0] < 50;
  EXPECT_GT(written, 100) << "the title, in bright letters";
  EXPECT_EQ(Differing(a, b, {0, 40, 1280, 680}), 0);
  std::string reason;
  for (int i = 0; i < 40; ++i) reason += "the marker was lost ";
  const Image3u8 end = titled.Conclude("marker lost", reason).ToImage();
  EXPECT_GT(Differing(b, end, {540, 190, 200, 40}), 1000);   // the outcome
  EXPECT_GT(Differing(b, end, {90, 240, 1100, 100}), 5000);  // the reason, in several lines
  int bright_at_the_edge = 0;
  for (int v = 180; v < 480; ++v) bright_at_the_edge += end.at(2, v)[0] > 100;
  EXPECT_EQ(bright_at_the_edge, 0) << "a line is wider than the picture";
}

// What has been drawn stays where it is: the axis is that of the whole trial from the start.
TEST(VideoComposer, TheAxisOfTimeIsTheWholeTrials) {
  const StereoImage images{{Image3u8(640, 480), Image3u8(640, 480)}};
  trial::Scenario scenario;
  scenario.duration_s = 60;
  VideoComposer composer(scenario);
  Image3u8 early, late;
  for (int i = 0; i < 300; ++i) {
    const media::Canvas& canvas = composer.Compose({images, kNone, Record(0.1 * i, 0.8)});
    if (i == 150) early = canvas.ToImage();
    if (i == 299) late = canvas.ToImage();
  }
  EXPECT_EQ(Differing(early, late, {365, 525, 90, 80}), 0);
  EXPECT_GT(Differing(early, late, {480, 525, 80, 80}), 50);
}

TEST(VideoComposer, ZeroHasNoSign) {
  const StereoImage images{{Image3u8(640, 480), Image3u8(640, 480)}};
  const auto at = [&](double y_m) {
    trial::FrameRecord record = Record(0, 0.8);
    record.true_X_HM.p.y() = record.est_X_HM.p.y() = y_m;
    return VideoComposer({}).Compose({images, kNone, record}).ToImage();
  };
  EXPECT_EQ(Differing(at(-0.0003), at(0.0003), {1160, 502, 110, 16}), 0);
  EXPECT_GT(Differing(at(-0.003), at(0.0003), {1160, 502, 110, 16}), 10);
}

// The values of now stand above the right ends of the charts: of F one, of x truth and estimate.
TEST(VideoComposer, WritesTheValuesOfNow) {
  const StereoImage images{{Image3u8(640, 480), Image3u8(640, 480)}};
  VideoComposer composer({});
  const Image3u8 picture = composer.Compose({images, kNone, Record(0, 0.8)}).ToImage();
  const auto letters = [&](const media::PixelRect& in) {
    int count = 0;
    for (int v = in.y; v < in.bottom(); ++v)
      for (int u = in.x; u < in.right(); ++u) count += picture.at(u, v)[2] > 150;
    return count;
  };
  EXPECT_GT(letters({750, 505, 32, 14}), 20);
  EXPECT_GT(letters({750, 614, 32, 14}), 20);
  EXPECT_GT(letters({700, 614, 40, 14}), 20);
  EXPECT_EQ(letters({500, 614, 150, 14}), 0);
}

// Servoing must be closer than docking may be: the chart of y has green ground as high as that.
TEST(VideoComposer, TheBandIsThatOfTheStage) {
  const StereoImage images{{Image3u8(640, 480), Image3u8(640, 480)}};
  const auto rows_of_band = [&](control::Stage stage) {
    VideoComposer composer({});
    trial::FrameRecord record = Record(0, 0.8);
    record.stage = stage;
    record.controlled = true;
    const media::Canvas* canvas = nullptr;
    for (int i = 0; i < 300; ++i) {
      record.time_s = 0.05 * i;
      canvas = &composer.Compose({images, kNone, record});
    }
    const Image3u8 picture = canvas->ToImage();
    int rows = 0;
    for (int v = 522; v < 596; ++v) {
      const uint8_t* p = picture.at(860, v);
      rows += p[1] > p[0] + 15 && p[1] > p[2] + 4;
    }
    return rows;
  };
  const int servoing = rows_of_band(control::Stage::kVisualServoing);
  EXPECT_GT(servoing, 5);
  EXPECT_NEAR(rows_of_band(control::Stage::kDocking), 2 * servoing, 6);  // 40 mm for 20
  EXPECT_EQ(rows_of_band(control::Stage::kApproach), 0);
}

// The vehicle begins a metre before the dock: seen from outside, it is in the picture, whatever
// wall of the pool is then in the way.
TEST(VideoFromOutside, HasTheVehicleInIt) {
  trial::Scenario scenario = trial::LoadScenario(
      "pool_active", {"trial.duration_s=0.1", "estimator.pose_source=true_pose"});
  for (const double distance_m : {0.9, 1.4, 2.2}) {
    scenario.start.distance_min_m = scenario.start.distance_max_m = distance_m;
    trial::TrialOptions options;
    options.spectator = true;
    int yellow = 0, balls = 0;
    options.observe = [&](const trial::TrialFrame& frame) {
      yellow = balls = 0;
      for (size_t i = 0; i < frame.spectator->pixels(); ++i) {
        const uint8_t* p = frame.spectator->data() + 3 * i;
        yellow += p[0] > 120 && p[1] > 90 && p[2] < 0.45 * p[1];
        balls += p[0] > 150 && p[1] < 60 && p[2] < 60;
      }
    };
    trial::RunTrial(scenario, options);
    EXPECT_GT(yellow, 250) << distance_m;  // the hull
    EXPECT_GT(balls, 1) << distance_m;     // the marker's red one
  }
}

TEST(Mp4Writer, UnwritablePathIsAConfigError) {
  const std::string no_folder = ::testing::TempDir() + "no_folder";
  std::ofstream(no_folder) << "a file";
  EXPECT_THROW(media::Mp4Writer(no_folder + "/video.mp4", 64, 64, 30), ConfigError);
}

TEST(Mp4Writer, MissingFfmpegNamesThePackage) {
  const std::string path = std::getenv("PATH");
  ASSERT_EQ(setenv("PATH", "/no_such_folder", 1), 0);
  std::string message = "no fault";
  try {
    media::Mp4Writer video(::testing::TempDir() + "/no_ffmpeg.mp4", 64, 64, 30);
  } catch (const SimulatorFault& fault) {
    message = fault.what();
  }
  setenv("PATH", path.c_str(), 1);
  EXPECT_THAT(message, HasSubstr("cannot start ffmpeg"));
  EXPECT_THAT(message, HasSubstr("package ffmpeg"));
}

TEST(Mp4Writer, AFullDiskIsSaidAndTheFileThatWasThereStays) {
  namespace fs = std::filesystem;
  const std::string path = ::testing::TempDir() + "/full_disk.mp4";
  std::ofstream(path) << "precious";
  fs::remove(path + ".partial");
  fs::create_symlink("/dev/full", path + ".partial");  // where it is written first
  std::string message = "no error";
  {
    media::Canvas frame(64, 64);
    media::Mp4Writer writer(path, 64, 64, 30);
    try {
      for (int i = 0; i < 10; ++i) writer.Add(frame);
      writer.Finish();
    } catch (const ConfigError& error) {
      message = error.what();
    }
  }
  EXPECT_EQ(message, path + ": cannot be written: No space left on device");
  std::string kept;
  std::getline(std::ifstream(path), kept);
  EXPECT_EQ(kept, "precious");
  EXPECT_FALSE(fs::is_symlink(path + ".partial"));
}

TEST(Mp4Writer, WithoutAnEndThereIsNoFile) {
  namespace fs = std::filesystem;
  const std::string path = ::testing::TempDir() + "/no_end.mp4";
  fs::remove(path);
  { media::Mp4Writer(path, 64, 64, 30).Add(media::Canvas(64, 64)); }
  EXPECT_FALSE(fs::exists(path));
  EXPECT_FALSE(fs::exists(path + ".partial"));
}

}  // namespace
}  // namespace turbidock::run
