#include "experiments/studies/run/trial_figure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "experiments/media/png.h"
#include "tests/studies/run/synthetic_trial.h"

namespace turbidock::run {
namespace {

using control::Stage;

std::string Path(const std::string& name) { return ::testing::TempDir() + "/" + name; }

Image3u8 Figure(const std::string& name, const trial::TrialLog& log, const FigureInfo& info = {}) {
  const std::string path = Path(name);
  WriteTrialFigure(path, log, info);
  return media::ReadPng(path);
}

bool Is(const uint8_t* pixel, Rgb color, int tolerance = 12) {
  for (size_t c = 0; c < 3; ++c)
    if (std::abs(pixel[c] - color[c]) > tolerance) return false;
  return true;
}

int Count(const Image3u8& image, Rgb color) {
  int count = 0;
  for (int v = 0; v < image.height(); ++v)
    for (int u = 0; u < image.width(); ++u) count += Is(image.at(u, v), color);
  return count;
}

// Rows of that colour in a column, from `top` to `bottom`.
std::vector<int> Rows(const Image3u8& image, int column, Rgb color, int top, int bottom) {
  std::vector<int> rows;
  for (int v = top; v < bottom; ++v)
    if (Is(image.at(column, v), color)) rows.push_back(v);
  return rows;
}

Rgb Over(const Rgb& ground, Rgb color, double opacity) {
  for (size_t c = 0; c < 3; ++c)
    color[c] = static_cast<uint8_t>(std::lround(ground[c] + opacity * (color[c] - ground[c])));
  return color;
}

// The band about the desired value, over the colour of the stage behind it.
Rgb BandColor(Stage stage) {
  const Rgb ground = Over({255, 255, 255}, trial::kOnPaper.Of(stage), 0.10);
  return Over(ground, trial::kOnPaper.limit, 0.18);
}

// The panels' first rows and last.
constexpr double kStep = (0.88 - 0.05) / 5 * kFigureHeight;
constexpr int kYTop = static_cast<int>(0.12 * kFigureHeight + kStep) + 3,
              kYBottom = static_cast<int>(kYTop + kStep - 0.015 * kFigureHeight) - 6,
              kZTop = static_cast<int>(kYTop + kStep),
              kZBottom = static_cast<int>(kYBottom + kStep),
              kFTop = static_cast<int>(kYTop + 3 * kStep),
              kFBottom = static_cast<int>(kYBottom + 3 * kStep);

// The marker holds still at y = 40 mm, the edge of docking's band about the desired 0; nothing is
// detected, so no estimate covers it.
trial::TrialLog OnTheEdge() {
  trial::TrialLog log;
  for (int k = 0; k < 60; ++k) {
    trial::FrameRecord f;
    f.frame = k;
    f.time_s = f.image_time_s = k / 30.0;
    f.stage = Stage::kDocking;
    f.controlled = true;
    f.fitness = 0;
    f.true_X_HM.p = {0.6, 0.040, -0.040};
    f.est_X_HM.p = {5, 5, 5};
    f.desired = {0.6, 0, 0, 0};
    log.frames.push_back(f);
  }
  return log;
}

TEST(Figure, HasItsSizeAndAllItsParts) {
  const Image3u8 image = Figure("trial.png", testing::SyntheticTrial(36),
                                {.title = "A trial", .outcome = "Docked.", .criteria = {}});
  ASSERT_EQ(image.width(), kFigureWidth);
  ASSERT_EQ(image.height(), kFigureHeight);
  EXPECT_GT(Count(image, trial::kOnPaper.estimate), 2000);
  EXPECT_GT(Count(image, trial::kOnPaper.truth), 500);
  EXPECT_GT(Count(image, trial::kOnPaper.desired), 300);
  EXPECT_GT(Count(image, trial::kOnPaper.limit), 2000);
  EXPECT_GT(Count(image, {255, 255, 255}), 100000);
}

// Behind the curves are the stages' colours, pale, each for its share of the time.
TEST(Figure, ColoursShowTheStages) {
  const trial::TrialLog log = testing::SyntheticTrial(36);
  const Image3u8 image = Figure("stages.png", log);
  constexpr double kLeftEnd = 0.08 * kFigureWidth, kRightEnd = 0.925 * kFigureWidth;
  int shown = 0;
  for (const double share : {0.02, 0.13, 0.17, 0.43, 0.47, 0.53, 0.57, 0.63, 0.67, 0.93, 0.97}) {
    const int column = static_cast<int>(std::lround(kLeftEnd + share * (kRightEnd - kLeftEnd)));
    const auto frame = static_cast<size_t>(share * static_cast<double>(log.frames.size()));
    const Rgb color = Over({255, 255, 255}, trial::kOnPaper.Of(log.frames[frame].stage), 0.1);
    shown += Rows(image, column, color, kYTop, kYBottom).size() > 30 ? 1 : 0;
  }
  EXPECT_EQ(shown, 11);
}

// Truth, desired value and band share one axis: a truth on the band's edge is drawn there.
TEST(Figure, TruthOnTheEdgeOfTheBandIsDrawnThere) {
  const Image3u8 image = Figure("edge.png", OnTheEdge());
  constexpr int kColumn = 700;
  const Rgb band = BandColor(Stage::kDocking);
  // rows of the panels of y (truth on the upper edge) and z (on the lower edge)
  const std::vector<int> y_band = Rows(image, kColumn, band, kYTop, kYBottom);
  const std::vector<int> y_truth = Rows(image, kColumn, trial::kOnPaper.truth, kYTop, kYBottom);
  const std::vector<int> z_band = Rows(image, kColumn, band, kZTop, kZBottom);
  const std::vector<int> z_truth = Rows(image, kColumn, trial::kOnPaper.truth, kZTop, kZBottom);
  ASSERT_GT(y_band.size(), 50u);
  ASSERT_GT(z_band.size(), 50u);
  ASSERT_GE(y_truth.size(), 2u);
  ASSERT_GE(z_truth.size(), 2u);
  EXPECT_NEAR(y_truth.front(), y_band.front(), 4);
  EXPECT_NEAR(z_truth.back(), z_band.back(), 4);
}

// y and z have bands of their own.
TEST(Figure, BandsAreTheirOwnTolerances) {
  FigureInfo info;
  info.criteria.tolerance_z_m = 0.020;
  const Image3u8 image = Figure("bands.png", OnTheEdge(), info);
  constexpr int kColumn = 700;
  const Rgb band = BandColor(Stage::kDocking);
  const std::vector<int> y_band = Rows(image, kColumn, band, kYTop, kYBottom);
  const std::vector<int> z_band = Rows(image, kColumn, band, kZTop, kZBottom);
  ASSERT_GT(y_band.size(), 50u);
  ASSERT_GT(z_band.size(), 50u);
  // z's axis holds the truth at -40 mm, beyond the band.
  const std::vector<int> z_truth = Rows(image, kColumn, trial::kOnPaper.truth, kZTop, kZBottom);
  ASSERT_GE(z_truth.size(), 2u);
  EXPECT_GT(z_truth.front(), z_band.back() + 20);
}

// Servoing must be closer than docking may be.
TEST(Figure, BandsAreThoseOfTheStage) {
  trial::TrialLog log = OnTheEdge();
  for (trial::FrameRecord& frame : log.frames) frame.stage = Stage::kVisualServoing;
  const auto band = [](const Image3u8& image, Stage stage) {
    return static_cast<double>(Rows(image, 700, BandColor(stage), kYTop, kYBottom).size());
  };
  const double docking = band(Figure("docking.png", OnTheEdge()), Stage::kDocking);
  EXPECT_NEAR(band(Figure("servoing.png", log), Stage::kVisualServoing), docking / 2, 12);
}

// A sentence as long as a false dock's ends within the figure.
TEST(Figure, ALongOutcomeIsNotCut) {
  FigureInfo info;
  info.outcome = "false_dock: ";
  while (info.outcome.size() < 215) info.outcome += "the docking criterion was met after 31.4 s ";
  const Image3u8 image = Figure("long.png", OnTheEdge(), info);
  const auto dark = [&](int from, int to) {
    int count = 0;
    for (int v = 5; v < 40; ++v)
      for (int u = from; u < to; ++u) count += image.at(u, v)[0] < 128;
    return count;
  };
  EXPECT_GT(dark(112, 300), 100);  // it is there
  EXPECT_EQ(dark(kFigureWidth - 3, kFigureWidth), 0);
}

// The line of F lies at the share of the axis that its value has between the lines at 0.22 and
// 0.60.
TEST(Figure, FitnessIsDrawnInProportion) {
  trial::TrialLog log = OnTheEdge();
  for (trial::FrameRecord& frame : log.frames) frame.fitness = 0.41;
  const Image3u8 image = Figure("proportion.png", log);
  // away from the dashes of the grid's lines
  const std::vector<int> limits = Rows(image, 640, trial::kOnPaper.limit, kFTop, kFBottom);
  const std::vector<int> fitness = Rows(image, 640, trial::kOnPaper.estimate, kFTop, kFBottom);
  ASSERT_GE(limits.size(), 2u);
  ASSERT_GE(fitness.size(), 1u);
  EXPECT_NEAR(fitness.front(), (limits.front() + limits.back()) / 2.0, 2);
}

TEST(Figure, DesiredIsDrawnOnlyWhileItIsFollowed) {
  trial::TrialLog log = OnTheEdge();
  for (trial::FrameRecord& frame : log.frames) frame.controlled = false;
  const int without = Count(Figure("drifting.png", log), trial::kOnPaper.desired);
  for (size_t k = 30; k < log.frames.size(); ++k) log.frames[k].controlled = true;
  const int half = Count(Figure("half.png", log), trial::kOnPaper.desired);
  const int whole = Count(Figure("whole.png", OnTheEdge()), trial::kOnPaper.desired);
  EXPECT_GT(whole, without + 200);
  // without counts the mark in the legend
  EXPECT_NEAR(half - without, (whole - without) / 2, 0.15 * (whole - without));
}

TEST(Figure, AwkwardTrialsCanBeDrawn) {
  trial::TrialLog one;
  one.frames.emplace_back();
  EXPECT_EQ(Figure("one.png", one).width(), kFigureWidth);

  // stages as short as a frame, values that are not finite, words that gnuplot could take for its
  // own
  trial::TrialLog restless = testing::SyntheticTrial(3);
  for (size_t k = 0; k < restless.frames.size(); ++k)
    restless.frames[k].stage = EnumNames<control::Stage>::kNames[k % 4].first;
  restless.frames[40].est_X_HM.p.y() = NAN;
  const FigureInfo info{.title = "it's 50 % \"milk\" $x `date` @a_b^{c}",
                        .outcome = "two\nlines \\n",
                        .criteria = {}};
  EXPECT_GT(Count(Figure("restless.png", restless, info), trial::kOnPaper.estimate), 100);
}

TEST(Figure, UnwritablePathIsAConfigError) {
  EXPECT_THROW(WriteTrialFigure(Path("no_such_folder/f.png"), OnTheEdge(), {}), ConfigError);
}

TEST(FigureDeath, NeedsAFrame) {
  EXPECT_DEATH(WriteTrialFigure(Path("empty.png"), trial::TrialLog{}, {}), "needs a frame");
}

}  // namespace
}  // namespace turbidock::run
