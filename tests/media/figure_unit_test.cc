#include "experiments/media/figure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "experiments/media/png.h"
#include "experiments/system/output_path.h"
#include "sim/base/check.h"

namespace turbidock::media {
namespace {

using namespace report;  // NOLINT(google-build-using-namespace): the model of what is drawn
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr Rgb kRed{255, 0, 0}, kPaper{255, 255, 0}, kInk{0, 0, 0};

std::string Path(const std::string& name) { return ::testing::TempDir() + "/" + name; }

// Pixels of exactly this colour, and the first and last of their columns and rows.
struct Found {
  int pixels = 0, left = 1 << 20, right = -1, top = 1 << 20, bottom = -1;
};
Found Find(const Image3u8& image, const Rgb& rgb, int from_column = 0, int to_column = 1 << 20) {
  Found found;
  for (int v = 0; v < image.height(); ++v) {
    for (int u = from_column; u < std::min(to_column, image.width()); ++u) {
      if (!std::equal(rgb.begin(), rgb.end(), image.at(u, v))) continue;
      ++found.pixels;
      found.left = std::min(found.left, u);
      found.right = std::max(found.right, u);
      found.top = std::min(found.top, v);
      found.bottom = std::max(found.bottom, v);
    }
  }
  return found;
}

// A panel of yellow paper over [0, 4] x [0, 1].
Panel Paper(const Series& series = {}) {
  return {.x = {"", 0, 4}, .y = {"", 0, 1}, .blocks = {{.color = kPaper}}, .series = {series}};
}

Image3u8 Drawn(const Panel& panel) {
  const std::string path = Path("plot.png");
  WriteFigure(path, {.width_px = 500, .height_px = 300, .panels = {panel}});
  return ReadPng(path);
}

// Where a value is on the paper.
double Column(const Image3u8& image, double x) {
  const Found paper = Find(image, kPaper);
  return paper.left + (paper.right - paper.left) * x / 4;
}
double Row(const Image3u8& image, double y) {
  const Found paper = Find(image, kPaper);
  return paper.bottom - (paper.bottom - paper.top) * y;
}

// Two runs with a gap: the line crosses neither the gap nor its neighbourhood.
TEST(Plot, DrawsRunsOfDataWithTheGapBetweenThem) {
  for (const Sample& gap : {Sample{}, Sample{2, INFINITY}, Sample{std::nan(""), 0.5}}) {
    const Image3u8 image =
        Drawn(Paper({"", {{0, 0.5}, {1, 0.5}, gap, {3, 0.5}, {4, 0.5}}, kRed, Mark::kLine, 2}));
    ASSERT_EQ(image.width(), 500);
    ASSERT_EQ(image.height(), 300);
    const int middle = static_cast<int>(Column(image, 2));
    EXPECT_NEAR(Find(image, kRed, 0, middle).right, Column(image, 1), 4);
    EXPECT_NEAR(Find(image, kRed, middle).left, Column(image, 3), 4);
    EXPECT_NEAR(Find(image, kRed).left, Column(image, 0), 4);
    EXPECT_NEAR(Find(image, kRed).right, Column(image, 4), 4);
    EXPECT_GT(Find(image, kRed).pixels, 150);
  }
}

// Six digits would put both dots on the left end.
TEST(Plot, NumbersKeepTheirValue) {
  Panel panel = Paper({"", {{1 + 1e-9, 0.5}, {1 + 3e-9, 0.5}}, kRed, Mark::kDots});
  panel.x = {"", 1, 1 + 4e-9};
  const Image3u8 image = Drawn(panel);
  EXPECT_NEAR((Find(image, kRed).left + Find(image, kRed).right) / 2.0, Column(image, 2), 3);
  EXPECT_NEAR(Find(image, kRed).left, Column(image, 1), 6);
}

TEST(Plot, BandsAndBarsReachFromLowToHigh) {
  for (const Mark mark : {Mark::kBand, Mark::kBars, Mark::kLineWithBars}) {
    Image3u8 image =
        Drawn(Paper({"", {{0.5, 0.5, 0.25, 0.75}, {3.5, 0.5, 0.25, 0.75}}, kRed, mark}));
    // a band lets the paper through
    const Rgb color = mark == Mark::kBand ? Rgb{255, 209, 0} : kRed;
    EXPECT_NEAR(Find(image, color).top, Row(image, 0.75), 3);
    EXPECT_NEAR(Find(image, color).bottom, Row(image, 0.25), 3);
  }
}

TEST(Plot, TheSecondAxisHasItsOwnScale) {
  Panel panel = Paper({.points = {{0, 30}, {4, 30}}, .color = kRed, .second_axis = true});
  panel.y2 = {"", 0, 40};
  const Image3u8 image = Drawn(panel);
  EXPECT_NEAR((Find(image, kRed).top + Find(image, kRed).bottom) / 2.0, Row(image, 0.75), 2);
}

TEST(Plot, AnAxisMayRunDownwardsAndHaveNamesForNumbers) {
  Panel panel = Paper({"", {{2, 0}}, kRed, Mark::kDots});
  panel.y = {.low = 1.5, .high = -0.5, .names = {"first", "second"}};
  const Image3u8 image = Drawn(panel);
  EXPECT_NEAR((Find(image, kRed).top + Find(image, kRed).bottom) / 2.0, Row(image, 0.75), 3);
}

TEST(Plot, RulesGoThroughTheWholePanel) {
  Panel panel = Paper();
  panel.rules = {{0.25, "", kRed, Mark::kLine, 2}};
  const Image3u8 across = Drawn(panel);
  EXPECT_NEAR(Find(across, kRed).left, Find(across, kPaper).left, 3);
  EXPECT_NEAR(Find(across, kRed).right, Find(across, kPaper).right, 3);
  EXPECT_NEAR(Find(across, kRed).top, Row(across, 0.25), 3);
  panel.rules = {{3, "", kRed, Mark::kLine, 2, true}};
  const Image3u8 up = Drawn(panel);
  EXPECT_NEAR(Find(up, kRed).top, Find(up, kPaper).top, 3);
  EXPECT_NEAR(Find(up, kRed).bottom, Find(up, kPaper).bottom, 3);
  EXPECT_NEAR(Find(up, kRed).left, Column(up, 3), 3);
}

// Without a legend the words are at the line's height, to the right of the panel.
TEST(Plot, ARuleIsNamedBesideThePanelOrInTheLegend) {
  Panel panel = Paper();
  panel.rules = {{0.75, "III", kRed, Mark::kNone}};
  const Image3u8 beside = Drawn(panel);
  EXPECT_GT(Find(beside, kRed).left, Find(beside, kPaper).right);
  EXPECT_NEAR((Find(beside, kRed).top + Find(beside, kRed).bottom) / 2.0, Row(beside, 0.75), 8);
  panel.rules[0].mark = Mark::kLine;
  panel.legend = true;
  const Image3u8 above = Drawn(panel);
  EXPECT_LT(Find(above, kRed).top, Find(above, kPaper).top);
  EXPECT_LE(Find(above, kRed).right, Find(above, kPaper).right + 1);
}

TEST(Plot, TheLegendNamesSeriesAlsoWithoutData) {
  Panel panel = Paper({"nothing yet", {}, kRed});
  panel.legend = true;
  const Image3u8 image = Drawn(panel);
  EXPECT_GT(Find(image, kRed).pixels, 10);
  EXPECT_LT(Find(image, kRed).bottom, Find(image, kPaper).top);
  panel.series[0].name = "";
  EXPECT_EQ(Find(Drawn(panel), kRed).pixels, 0);
}

TEST(Plot, BlocksAreNamedInTheLegend) {
  Panel panel = Paper();
  panel.legend = true;
  panel.blocks.push_back({.name = "half", .from_x = 3, .to_x = 4, .color = kRed});
  const Image3u8 image = Drawn(panel);
  EXPECT_GT(Find(image, kRed, static_cast<int>(Column(image, 3)) + 2).pixels, 500);
  const Found mark = Find(image, kRed, 0, static_cast<int>(Column(image, 3)) - 2);
  EXPECT_GT(mark.pixels, 10);
  EXPECT_LT(mark.bottom, Find(image, kPaper).top);
}

TEST(Plot, StackedPanelsShareTheirColumnsAndAreOfOneHeight) {
  Panel upper = Paper();
  upper.blocks[0].color = kRed;
  const std::string path = Path("stack.png");
  WriteFigure(path,
              {.stacked = true, .width_px = 600, .height_px = 350, .panels = {upper, Paper()}});
  const Image3u8 image = ReadPng(path);
  const Found top = Find(image, kRed), bottom = Find(image, kPaper);
  EXPECT_EQ(top.left, bottom.left);
  EXPECT_EQ(top.right, bottom.right);
  EXPECT_LT(top.bottom, bottom.top);
  EXPECT_NEAR(top.bottom - top.top, bottom.bottom - bottom.top, 2);
}

TEST(Plot, PanelsStandRowByRow) {
  constexpr std::array<Rgb, 4> kColors{kPaper, kRed, kInk, Rgb{0, 0, 255}};
  Figure figure{.columns = 3, .width_px = 300, .height_px = 200};
  for (const Rgb& color : kColors) {
    figure.panels.push_back(Paper());
    figure.panels.back().blocks[0].color = color;
  }
  const std::string path = Path("grid.png");
  WriteFigure(path, figure);
  const Image3u8 image = ReadPng(path);
  ASSERT_EQ(image.width(), 900);
  ASSERT_EQ(image.height(), 400);
  for (size_t i = 0; i < kColors.size(); ++i) {
    const Found panel = Find(image, kColors[i]);
    const int left = 300 * static_cast<int>(i % 3), top = 200 * static_cast<int>(i / 3);
    EXPECT_GT(panel.pixels, 5000) << i;
    EXPECT_GE(panel.left, left) << i;
    EXPECT_LT(panel.right, left + 300) << i;
    EXPECT_GE(panel.top, top) << i;
    EXPECT_LT(panel.bottom, top + 200) << i;
  }
}

TEST(Plot, AReportsSectionsAreRowsWhereTheyHaveAsManyPlots) {
  const auto columns = [](const std::vector<size_t>& plots) {
    report::Report report;
    for (const size_t count : plots) {
      report.sections.push_back({.title = "section"});
      report.sections.back().panels.resize(count);
    }
    return FigureOf(report).columns;
  };
  EXPECT_EQ(columns({4, 4, 0, 4}), 4u);
  EXPECT_EQ(columns({2}), 2u);
  EXPECT_EQ(columns({2, 1}), 3u);
  EXPECT_EQ(columns({1, 1}), 2u);
  EXPECT_EQ(columns({5}), 3u);
  EXPECT_EQ(columns({}), 1u);
}

// An axis that is to follow the data, and no data, or only some that is no number.
TEST(Plot, AFigureWithoutDataCanBeDrawn) {
  for (const bool logarithmic : {false, true}) {
    const Panel panel{.x = {.logarithmic = logarithmic},
                      .y = {.low = 1, .logarithmic = logarithmic},
                      .series = {{}, {"", {{1, NAN}}}, {.second_axis = true}}};
    EXPECT_EQ(Drawn(panel).width(), 500);
  }
}

TEST(Plot, TextStandsForItself) {
  const auto drawn = [](const std::string& text) {
    const std::string path = Path("text.png");
    WriteFigure(path, {.title = text,
                       .panels = {{.title = text,
                                   .x = {text, 0, 1},
                                   .y = {.low = 0, .high = 1, .names = {text}},
                                   .blocks = {{.name = text, .from_x = 0, .to_x = 1}},
                                   .series = {{text}},
                                   .rules = {{0.5, text}},
                                   .legend = true}}});
    const Image3u8 image = ReadPng(path);
    return std::vector<uint8_t>(image.data(), image.data() + 3 * image.width() * image.height());
  };
  EXPECT_EQ(drawn("two\nlines"), drawn("two lines"));
  // all that gnuplot could take for its own; each stands there, so leaving it out is seen
  for (const std::string text :
       {"it's", "a_b", "x^2", "{y}", "`date`", "$HOME", "\\n", "\"q\"", "@f", "50 %", "&", "~a"})
    EXPECT_NE(drawn(text), drawn(text.substr(1))) << text;
  EXPECT_NE(drawn("a_b"), drawn("a{_b}"));
}

TEST(Plot, WhatGnuplotCannotDrawIsAFaultWithItsWords) {
  Panel panel = Paper();
  panel.y = {"", -2, -1, true};
  try {
    Drawn(panel);
    FAIL() << "no fault";
  } catch (const SimulatorFault& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("gnuplot ended with exit status 1"));
    EXPECT_THAT(fault.what(), HasSubstr("log scale"));
  }
}

TEST(Plot, UnwritablePathIsAConfigError) {
  std::ofstream(Path("no_folder")) << "a file";
  EXPECT_THROW(WriteFigure(Path("no_folder/x.png"), {.panels = {Paper()}}), ConfigError);
}

TEST(Plot, OddPathsAreOnlyPaths) {
  const std::string path = Path("it's `odd` $HOME.png");
  std::filesystem::remove(path);
  WriteFigure(path, {.width_px = 300, .height_px = 80, .panels = {Paper()}});
  EXPECT_EQ(ReadPng(path).height(), 80);
}

TEST(Plot, EvenNumbersAreExactAtBothEnds) {
  EXPECT_THAT(Evenly(-1, 3, 4), ElementsAre(-1, 0, 1, 2, 3));
  EXPECT_EQ(Evenly(0.1, 0.7, 3).front(), 0.1);
  EXPECT_EQ(Evenly(0.1, 0.7, 3).back(), 0.7);
}

TEST(Plot, SamplesAreMadeOfFunctionsAndMembers) {
  struct Trial {
    int number;
    double cost;
  };
  const std::vector<Trial> trials = {{1, 0.5}, {2, 0.25}};
  const auto samples = SamplesOf(trials, &Trial::number, [](const Trial& t) { return 4 * t.cost; });
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(samples[1].x, 2);
  EXPECT_EQ(samples[1].y, 1);
  EXPECT_TRUE(std::isnan(samples[1].low));
}

TEST(PlotFormats, ThePathsEndSaysWhich) {
  const Figure figure{.title = "a title",
                      .width_px = 500,
                      .height_px = 300,
                      .panels = {Paper({.points = {{1, 0.5}, {2, 0.7}}})}};
  const auto written = [&](const std::string& name) {
    const std::string path = Path(name);
    WriteFigure(path, figure);
    return system::ReadWhole(path);
  };
  EXPECT_EQ(written("format.png").substr(1, 3), "PNG");
  EXPECT_EQ(written("format.pdf").substr(0, 5), "%PDF-");
  const std::string svg = written("format.svg");
  EXPECT_THAT(svg, HasSubstr("<svg"));
  EXPECT_THAT(svg, HasSubstr("a title"));
  EXPECT_THROW(WriteFigure(Path("format.jpg"), figure), ConfigError);
  EXPECT_THROW(RequireFigurePath("figure"), ConfigError);
}

}  // namespace
}  // namespace turbidock::media
