#include "experiments/media/gnuplot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "experiments/media/png.h"
#include "sim/base/check.h"

namespace turbidock::media {
namespace {

using ::testing::HasSubstr;

std::string Path(const std::string& name) { return ::testing::TempDir() + "/" + name; }

// Pixels of exactly this colour, and the rightmost and leftmost of their columns.
struct Found {
  int pixels = 0, first_column = 1 << 20, last_column = -1;
};
Found Find(const Image3u8& image, std::array<uint8_t, 3> rgb, int from_column = 0,
           int to_column = 1 << 20) {
  Found found;
  for (int v = 0; v < image.height(); ++v) {
    for (int u = from_column; u < std::min(to_column, image.width()); ++u) {
      const uint8_t* p = image.at(u, v);
      if (p[0] != rgb[0] || p[1] != rgb[1] || p[2] != rgb[2]) continue;
      ++found.pixels;
      found.first_column = std::min(found.first_column, u);
      found.last_column = std::max(found.last_column, u);
    }
  }
  return found;
}

GnuplotScript BareAxes() {
  GnuplotScript script;
  script.Line("unset key").Line("unset border").Line("unset tics");
  script.Line("set lmargin at screen 0").Line("set rmargin at screen 1");
  script.Line("set tmargin at screen 1").Line("set bmargin at screen 0");
  script.Line("set xrange [0:4]").Line("set yrange [0:1]");
  return script;
}

TEST(Gnuplot, QuotedTextStandsForItself) {
  EXPECT_EQ(GnuplotQuoted("plain"), "'plain'");
  EXPECT_EQ(GnuplotQuoted("it's \"so\" \\n"), "'it''s \"so\" \\n'");
  EXPECT_EQ(GnuplotQuoted("two\nlines"), "'two lines'");
}

TEST(Gnuplot, NumbersKeepTheirValueAndGapsAreNotNumbers) {
  GnuplotScript script;
  script.BeginData("d").Row({0.1, -2, 1e300}).Gap().Row({std::nan(""), INFINITY}).EndData();
  EXPECT_EQ(script.text(), "$d << END_OF_DATA\n0.1 -2 1e+300\n\nNaN NaN\nEND_OF_DATA\n");
}

// Two runs with a gap: the line crosses neither the gap nor its neighbourhood.
TEST(Gnuplot, DrawsRunsOfDataWithTheGapBetweenThem) {
  GnuplotScript script = BareAxes();
  script.BeginData("runs").Row({0, 0.5}).Row({1, 0.5}).Gap().Row({3, 0.5}).Row({4, 0.5}).EndData();
  script.Line("plot $runs using 1:2 with lines linewidth 6 linecolor rgb '#ff0000'");
  const std::string path = Path("gap.png");
  script.WritePng(path, 400, 100);
  const Image3u8 image = ReadPng(path);
  ASSERT_EQ(image.width(), 400);
  ASSERT_EQ(image.height(), 100);
  EXPECT_GT(Find(image, {255, 0, 0}).pixels, 600);
  EXPECT_EQ(Find(image, {255, 0, 0}, 106, 294).pixels, 0);
  EXPECT_NEAR(Find(image, {255, 0, 0}, 0, 200).last_column, 100, 4);
  EXPECT_NEAR(Find(image, {255, 0, 0}, 200).first_column, 300, 4);
}

TEST(Gnuplot, MistakesInTheScriptAreFaultsWithGnuplotsWords) {
  GnuplotScript script = BareAxes();
  script.Line("plot no_such_function(x)");
  try {
    script.WritePng(Path("mistake.png"), 100, 100);
    FAIL() << "no fault";
  } catch (const SimulatorFault& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("gnuplot ended with exit status 1"));
    EXPECT_THAT(fault.what(), HasSubstr("undefined function"));
  }
}

TEST(Gnuplot, UnwritablePathIsAConfigError) {
  GnuplotScript script = BareAxes();
  script.Line("plot x");
  EXPECT_THROW(script.WritePng(Path("no_such_folder/x.png"), 100, 100), ConfigError);
}

TEST(Gnuplot, OddPathsAreOnlyPaths) {
  GnuplotScript script = BareAxes();
  script.Line("plot x");
  const std::string path = Path("it's `odd` $HOME.png");
  std::filesystem::remove(path);
  script.WritePng(path, 100, 80);
  EXPECT_EQ(ReadPng(path).height(), 80);
}

}  // namespace
}  // namespace turbidock::media
