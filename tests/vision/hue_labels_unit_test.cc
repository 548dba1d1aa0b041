#include "vision/hue_labels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/base/random.h"
#include "sim/base/units.h"
#include "tests/support/message_of.h"
#include "tests/support/paint_marker.h"

namespace turbidock::vision {
namespace {

using testing::RgbOfHue;

// An image whose column u has hue u degrees, all of one chroma.
Image3u8 HueWheel(double saturation, double value_dn) {
  Image3u8 image(360, 8);
  for (int v = 0; v < image.height(); ++v)
    for (int u = 0; u < image.width(); ++u) {
      const Eigen::Vector3d rgb = RgbOfHue(units::RadFromDeg(u), saturation, value_dn);
      for (int k = 0; k < 3; ++k) image.at(u, v)[k] = static_cast<uint8_t>(std::lround(rgb[k]));
    }
  return image;
}

Image3u8 Plain(int width, int height, std::array<int, 3> rgb) {
  Image3u8 image(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      for (int k = 0; k < 3; ++k) image.at(u, v)[k] = static_cast<uint8_t>(rgb[k]);
  return image;
}

void PaintBlock(Image3u8* image, int u0, int v0, int size, std::array<int, 3> rgb) {
  for (int v = v0; v < v0 + size; ++v)
    for (int u = u0; u < u0 + size; ++u)
      for (int k = 0; k < 3; ++k) image->at(u, v)[k] = static_cast<uint8_t>(rgb[k]);
}

// Degrees from the default marker's balls (green, red, blue), around the circle.
int Label(int hue_deg, double window_deg, double* nearest_edge_deg) {
  int label = 0;
  *nearest_edge_deg = 1e9;
  const double balls_deg[] = {120, 0, 240};
  for (int b = 0; b < 3; ++b) {
    const double apart_deg = std::abs(std::remainder(hue_deg - balls_deg[b], 360.0));
    if (apart_deg <= window_deg) label |= 1 << b;
    *nearest_edge_deg = std::min(*nearest_edge_deg, std::abs(apart_deg - window_deg));
  }
  return label;
}

TEST(HueLabeller, WindowsAreAsWideAsAskedAndWrapAtRed) {
  for (const double window_deg : {20.5, 24.5, 75.5}) {  // the last one: windows overlap
    HueParams hue;
    hue.window_rad = units::RadFromDeg(window_deg);
    HueLabeller labeller(hue, MarkerParams{});
    Image1u8 labels;
    labeller.Label(HueWheel(1, 255), &labels);
    int checked = 0;
    for (int u = 0; u < 360; ++u) {
      double edge_deg = 0;
      const int expected = Label(u, window_deg, &edge_deg);
      // 8-bit colours hold the hue to 60 / 255 / 2 degrees, the table to another 0.12.
      if (edge_deg < 0.3) continue;
      ++checked;
      EXPECT_EQ(*labels.at(u, 3), expected) << u;
    }
    EXPECT_EQ(checked, 360);
  }
}

TEST(HueLabeller, GreysAndFaintColoursMatchNothing) {
  HueLabeller labeller(HueParams{}, MarkerParams{});
  Image1u8 labels;
  for (const auto& rgb : {std::array{0, 0, 0}, std::array{255, 255, 255}, std::array{90, 90, 90},
                          std::array{100, 111, 100}}) {
    labeller.Label(Plain(64, 48, rgb), &labels);
    for (size_t i = 0; i < labels.pixels(); ++i) ASSERT_EQ(labels.data()[i], 0);
  }
  // One step more is a match: the floor is 12.
  labeller.Label(Plain(64, 48, {100, 112, 100}), &labels);
  EXPECT_EQ(*labels.at(5, 5), 1);
}

TEST(HueLabeller, DropsWhatIsDimAgainstTheBallItself) {
  Image3u8 image = Plain(100, 60, {4, 4, 4});
  PaintBlock(&image, 10, 10, 20, {20, 220, 20});  // green ball, chroma 200
  PaintBlock(&image, 40, 10, 20, {10, 89, 10});   // lit by it, chroma 79 < 0.4 200
  PaintBlock(&image, 70, 10, 20, {10, 90, 10});   // chroma 80
  PaintBlock(&image, 10, 35, 20, {60, 10, 10});   // a dim red ball of its own: chroma 50
  HueLabeller labeller(HueParams{}, MarkerParams{});
  Image1u8 labels;
  labeller.Label(image, &labels);
  EXPECT_EQ(labeller.threshold_dn(0), 80);
  EXPECT_EQ(labeller.threshold_dn(1), 20);
  EXPECT_EQ(labeller.threshold_dn(2), 12);  // nothing blue: the floor
  EXPECT_EQ(*labels.at(20, 20), 1);
  EXPECT_EQ(*labels.at(50, 20), 0);
  EXPECT_EQ(*labels.at(80, 20), 1);
  EXPECT_EQ(*labels.at(20, 45), 2);

  HueParams hue_only;
  hue_only.own_chroma_fraction = 0;
  HueLabeller plain(hue_only, MarkerParams{});
  plain.Label(image, &labels);
  EXPECT_EQ(*labels.at(50, 20), 1);
}

TEST(HueLabeller, LoneBrightPixelsDoNotSetTheOwnChroma) {
  Image3u8 image = Plain(200, 100, {4, 4, 4});
  PaintBlock(&image, 10, 10, 12, {20, 120, 20});
  for (int v = 30; v < 90; v += 2)
    for (int u = 2; u < 198; u += 3) PaintBlock(&image, u, v, 1, {0, 255, 0});
  HueParams hue;
  hue.own_chroma_image_share = 40.0 / (200 * 100);
  HueLabeller labeller(hue, MarkerParams{});
  Image1u8 labels;
  labeller.Label(image, &labels);
  EXPECT_EQ(labeller.threshold_dn(0), 40);
}

TEST(HueParams, OwnChromaPixelsFollowTheSizeOfTheImage) {
  const HueParams hue;
  EXPECT_EQ(hue.OwnChromaPixels(640, 480), 40);
  EXPECT_EQ(hue.OwnChromaPixels(320, 240), 10);
  EXPECT_EQ(hue.OwnChromaPixels(160, 120), 3);  // a half is rounded up
  EXPECT_EQ(hue.OwnChromaPixels(1280, 960), 160);
  EXPECT_EQ(hue.OwnChromaPixels(8, 8), 1);  // never none
}

TEST(HueLabeller, OwnChromaIsTheOneThatEnoughPixelsReach) {
  // 8 x 8 bright pixels make 8 x 7 pairs.
  Image3u8 image = Plain(100, 60, {4, 4, 4});
  PaintBlock(&image, 10, 10, 8, {0, 200, 0});
  PaintBlock(&image, 40, 10, 20, {0, 100, 0});
  for (const auto& [pixels, threshold] : {std::pair{56, 80}, std::pair{57, 40}}) {
    HueParams hue;
    hue.own_chroma_image_share = pixels / (100.0 * 60);
    HueLabeller labeller(hue, MarkerParams{});
    Image1u8 labels;
    labeller.Label(image, &labels);
    EXPECT_EQ(labeller.threshold_dn(0), threshold);
  }
}

TEST(HueLabeller, AgreesWithHueInDoublePrecision) {
  Image3u8 image(256, 256);
  Rng rng = SeedTree(1).Stream("colours");
  for (size_t i = 0; i < 3 * image.pixels(); ++i)
    image.data()[i] = static_cast<uint8_t>(rng.Below(256));
  HueParams hue;
  hue.own_chroma_fraction = 0;
  HueLabeller labeller(hue, MarkerParams{});
  Image1u8 labels;
  labeller.Label(image, &labels);
  int checked = 0, differ = 0;
  for (int v = 0; v < image.height(); ++v)
    for (int u = 0; u < image.width(); ++u) {
      const Eigen::Vector3d rgb(image.at(u, v)[0], image.at(u, v)[1], image.at(u, v)[2]);
      // Angle in the plane across the grey axis, bent into the hexagon's hue by its definition.
      const double high = rgb.maxCoeff(), chroma = high - rgb.minCoeff();
      int expected = 0;
      if (chroma >= 12) {
        double sextant = rgb[0] == high   ? (rgb[1] - rgb[2]) / chroma
                         : rgb[1] == high ? 2 + (rgb[2] - rgb[0]) / chroma
                                          : 4 + (rgb[0] - rgb[1]) / chroma;
        const double hue_rad = sextant * std::numbers::pi / 3;
        const MarkerParams marker;
        for (int b = 0; b < 3; ++b)
          if (std::abs(std::remainder(hue_rad - marker.balls[b].hue_rad, 2 * std::numbers::pi)) <=
              hue.window_rad)
            expected |= 1 << b;
      }
      ++checked;
      differ += *labels.at(u, v) != expected;
    }
  EXPECT_EQ(checked, 65536);
  // Six window edges blurred by half a table step of 0.23 degrees: 0.2 % of the circle.
  EXPECT_LE(differ, 150);
}

// The definition in plain words, one pixel after the other: hue windows in double precision, own
// chroma by sorting all pairs. `unsure`: pixels nearer to a window's edge than the kernel holds it.
Image1u8 PlainLabels(const Image3u8& image, const PixelRegion& part, const HueParams& hue,
                     const MarkerParams& marker, Image1u8* unsure) {
  Image1u8 labels(image.width(), image.height(), 0);
  *unsure = labels;
  Image1u8 chroma = labels;
  std::vector<std::vector<int>> pairs(marker.balls.size());
  for (int v = part.row_begin; v < part.row_end; ++v)
    for (int u = part.column_begin; u < part.column_end; ++u) {
      const uint8_t* rgb = image.at(u, v);
      const double r = rgb[0], g = rgb[1], b = rgb[2];
      const double high = std::max({r, g, b}), c = high - std::min({r, g, b});
      *chroma.at(u, v) = static_cast<uint8_t>(c);
      if (c < hue.chroma_floor_dn) continue;
      const double sextant = r == high   ? (g - b) / c
                             : g == high ? 2 + (b - r) / c
                                         : 4 + (r - g) / c;
      for (size_t i = 0; i < marker.balls.size(); ++i) {
        const double apart_rad = std::abs(std::remainder(
            sextant * std::numbers::pi / 3 - marker.balls[i].hue_rad, 2 * std::numbers::pi));
        if (std::abs(apart_rad - hue.window_rad) < std::numbers::pi / 3 / 254)
          *unsure->at(u, v) = 1;
        if (apart_rad > hue.window_rad) continue;
        *labels.at(u, v) |= static_cast<uint8_t>(1 << i);
        if (u > part.column_begin && *labels.at(u - 1, v) >> i & 1)
          pairs[i].push_back(std::min(*chroma.at(u, v), *chroma.at(u - 1, v)));
      }
    }
  for (size_t i = 0; i < marker.balls.size(); ++i) {
    std::sort(pairs[i].rbegin(), pairs[i].rend());
    const auto n = static_cast<size_t>(
        std::lround(hue.own_chroma_image_share * static_cast<double>(image.pixels())));
    const int own = pairs[i].size() >= n ? pairs[i][n - 1] : 0;
    for (size_t j = 0; j < labels.pixels(); ++j)
      if (chroma.data()[j] < std::ceil(hue.own_chroma_fraction * own))
        labels.data()[j] &= static_cast<uint8_t>(~(1 << i));
  }
  return labels;
}

TEST(HueLabeller, AgreesWithThePlainDefinition) {
  // An odd width, so that runs end everywhere in a row. First hues whose windows reach over the
  // sextants; then the default ones with a window whose edges few 8-bit colours are near to, so
  // that the gate can be compared as well.
  Rng rng = SeedTree(2).Stream("colours");
  constexpr double kSafeWindow_rad = 0.45;
  for (const double window_rad : {0.05, 0.7, 1.5, kSafeWindow_rad})
    for (const double spread : {8.0, 90.0}) {
      Image3u8 image(333, 61);
      for (int v = 0; v < image.height(); ++v)
        for (int u = 0; u < image.width(); ++u) {
          const Eigen::Vector3d rgb = RgbOfHue(0.02 * u, 0.6, 120);
          for (int k = 0; k < 3; ++k)
            image.at(u, v)[k] = static_cast<uint8_t>(
                std::lround(std::clamp(rgb[k] + spread * (rng.Uniform() - 0.5), 0.0, 255.0)));
        }
      HueParams hue;
      hue.window_rad = window_rad;
      hue.own_chroma_image_share = 40.0 / (333 * 61);
      MarkerParams marker;
      const bool gate = window_rad == kSafeWindow_rad;
      hue.own_chroma_fraction = gate ? 0.7 : 0;
      if (!gate) {
        marker.balls[0].hue_rad = 1.1;
        marker.balls[1].hue_rad = 6.2;
        marker.balls[2].hue_rad = 3.2;
      }
      for (const PixelRegion& part :
           {PixelRegion{0, 0, 333, 61}, {7, 3, 300, 60}, {130, 10, 259, 11}, {40, 40, 40, 60}}) {
        HueLabeller labeller(hue, marker);
        Image1u8 labels(333, 61, 0);
        labeller.Label(image, part, &labels);
        Image1u8 unsure;
        const Image1u8 plain = PlainLabels(image, part, hue, marker, &unsure);
        int differ = 0, labelled = 0;
        for (size_t i = 0; i < labels.pixels(); ++i) {
          differ += labels.data()[i] != plain.data()[i] && (gate || !unsure.data()[i]);
          labelled += labels.data()[i] != 0;
        }
        EXPECT_EQ(differ, 0) << window_rad << ' ' << spread << ' ' << part.column_begin;
        EXPECT_GT(labelled, window_rad > 0.1 && !part.empty() ? 40 : -1);
      }
    }
}

TEST(HueLabeller, ReadsItsRegionOnly) {
  Image3u8 image = Plain(100, 60, {4, 4, 4});
  PaintBlock(&image, 30, 10, 20, {10, 90, 10});
  Image3u8 other = Plain(100, 60, {20, 255, 20});  // brighter green all around
  const PixelRegion part{25, 5, 60, 40};
  for (int v = part.row_begin; v < part.row_end; ++v)
    std::copy_n(image.at(part.column_begin, v), 3 * part.width(), other.at(part.column_begin, v));
  HueLabeller labeller(HueParams{}, MarkerParams{});
  Image1u8 labels(100, 60, 0xee), labels_of_other = labels;
  labeller.Label(image, part, &labels);
  EXPECT_EQ(labeller.threshold_dn(0), 32);
  labeller.Label(other, part, &labels_of_other);
  EXPECT_EQ(labeller.threshold_dn(0), 32);
  EXPECT_EQ(labels, labels_of_other);
  EXPECT_EQ(*labels.at(40, 20), 1);
  EXPECT_EQ(*labels.at(26, 20), 0);
  EXPECT_EQ(*labels.at(24, 20), 0xee);  // not its business
}

// Nor does a pixel at its edge have a neighbour outside, seen when more was looked at.
TEST(HueLabeller, PairsNoPixelWithOneOutsideItsRegion) {
  Image3u8 image = Plain(100, 60, {4, 4, 4});
  PaintBlock(&image, 30, 10, 20, {10, 90, 10});
  const PixelRegion column{49, 5, 60, 40};  // the block's last
  HueLabeller labeller(HueParams{}, MarkerParams{}), fresh = labeller;
  Image1u8 labels, labels_of_fresh(100, 60, 0);
  labeller.Label(image, &labels);
  EXPECT_EQ(labeller.threshold_dn(0), 32);
  labeller.Label(image, column, &labels);
  fresh.Label(image, column, &labels_of_fresh);
  EXPECT_EQ(labeller.threshold_dn(0), fresh.threshold_dn(0));
  EXPECT_LT(labeller.threshold_dn(0), 32);
}

// Grey water and a red ball, both with a cast; the ball's hue is back where the water is grey.
TEST(HueLabeller, TakesACastOutOfWholeImagesWithinItsBound) {
  const auto gain_of = [](std::array<int, 3> water, double most) {
    HueLabeller labeller({.most_cast_gain = most}, MarkerParams{});
    Image1u8 labels;
    labeller.Label(Plain(64, 64, water), &labels);
    return labeller.cast_gain();
  };
  using Gain = std::array<double, 3>;
  EXPECT_EQ(gain_of({50, 60, 60}, 2.5), (Gain{1, 1, 1})) << "the water's own";
  EXPECT_EQ(gain_of({4, 15, 8}, 2.5), (Gain{1, 1, 1})) << "dark";
  EXPECT_EQ(gain_of({40, 100, 64}, 2.5), (Gain{2, 1, 1.25}));
  EXPECT_EQ(gain_of({1, 100, 64}, 2.5), (Gain{2.5, 1, 1.25}));
  EXPECT_EQ(gain_of({40, 100, 64}, 1), (Gain{1, 1, 1}));

  HueLabeller labeller(HueParams{}, MarkerParams{});
  Image1u8 labels;
  Image3u8 image = Plain(64, 64, {40, 100, 64});
  PaintBlock(&image, 20, 20, 8, {110, 110, 70});  // yellow; in grey water (220, 110, 88)
  labeller.Label(image, &labels);
  EXPECT_EQ(*labels.at(24, 24), 2) << "red";
  // A part of an image may be all marker: it teaches nothing, and what was learned counts on.
  const PixelRegion part{16, 16, 32, 32};
  labeller.Label(image, part, &labels);
  EXPECT_EQ(*labels.at(24, 24), 2);
  labeller.Label(Plain(64, 64, {1, 100, 64}), part, &labels);
  EXPECT_EQ(labeller.cast_gain(), (Gain{2, 1, 1.25}));
  labeller.Label(Plain(64, 64, {60, 60, 60}), &labels);
  EXPECT_EQ(labeller.cast_gain(), (Gain{1, 1, 1}));
}

TEST(CheckHues, SaysByHowMuchTwoBallsDiffer) {
  MarkerParams marker;
  marker.balls[0].name = "lime";
  marker.balls[1].name = "fern";
  marker.balls[0].hue_rad = units::RadFromDeg(95);
  marker.balls[1].hue_rad = units::RadFromDeg(95 + 89.4);
  HueParams hue;
  hue.window_rad = units::RadFromDeg(89.9);
  EXPECT_EQ(testing::MessageOf([&] { CheckHues(marker, hue); }),
            "marker.balls: balls lime and fern cannot be told apart: their hues differ by 89°, "
            "less than the 90 of estimator.hue.window_rad");
}

}  // namespace
}  // namespace turbidock::vision
