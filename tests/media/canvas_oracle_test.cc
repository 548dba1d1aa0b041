#include "experiments/media/canvas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace turbidock::media {
namespace {

constexpr Rgb kRed{255, 0, 0};

int Red(const Image3u8& image, int u, int v) { return image.at(u, v)[0]; }

TEST(Canvas, LineAlongARowFillsExactlyThatRow) {
  Canvas canvas(20, 9);
  canvas.Line({-0.5, 4}, {19.5, 4}, 1, kRed);
  const Image3u8 image = canvas.ToImage();
  for (int v = 0; v < 9; ++v)
    for (int u = 0; u < 20; ++u) ASSERT_EQ(Red(image, u, v), v == 4 ? 255 : 0) << u << "," << v;
}

// Half a pixel lower, the line lies half on each of two rows.
TEST(Canvas, LineBetweenRowsIsSharedByThem) {
  Canvas canvas(20, 9);
  canvas.Line({-0.5, 4.5}, {19.5, 4.5}, 1, kRed);
  const Image3u8 image = canvas.ToImage();
  EXPECT_NEAR(Red(image, 10, 4), 127.5, 2);
  EXPECT_NEAR(Red(image, 10, 5), 127.5, 2);
  EXPECT_EQ(Red(image, 10, 3) + Red(image, 10, 6), 0);
}

TEST(Canvas, RectangleHasItsPixels) {
  Canvas canvas(12, 10);
  canvas.FillRect({3, 2, 4, 5}, {10, 20, 30});
  const Image3u8 image = canvas.ToImage();
  int filled = 0;
  for (int v = 0; v < 10; ++v) {
    for (int u = 0; u < 12; ++u) {
      const bool inside = u >= 3 && u < 7 && v >= 2 && v < 7;
      ASSERT_EQ(image.at(u, v)[2], inside ? 30 : 0);
      filled += inside;
    }
  }
  EXPECT_EQ(filled, 20);
  EXPECT_EQ(image.at(3, 2)[0], 10);
  EXPECT_EQ(image.at(3, 2)[1], 20);
}

// The coverage of all pixels adds up to the area of the ring.
TEST(Canvas, CircleCoversTheAreaOfItsRing) {
  Canvas canvas(64, 64);
  canvas.Circle({31.3, 30.8}, 20, 2, kRed);
  const Image3u8 image = canvas.ToImage();
  double covered_px = 0, moment_u_px = 0, moment_v_px = 0;
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 64; ++u) {
      const double share = Red(image, u, v) / 255.0;
      covered_px += share;
      moment_u_px += share * u;
      moment_v_px += share * v;
    }
  }
  EXPECT_NEAR(covered_px, 2 * std::numbers::pi * 20 * 2, 2);
  EXPECT_NEAR(moment_u_px / covered_px, 31.3, 0.05);
  EXPECT_NEAR(moment_v_px / covered_px, 30.8, 0.05);
}

TEST(Canvas, DotsStandOnTheirCircle) {
  Canvas canvas(100, 100);
  canvas.DottedCircle({50, 50}, 30, 8, 5, kRed);
  const Image3u8 image = canvas.ToImage();
  for (int i = 0; i < 16; ++i) {
    const double angle_rad = std::numbers::pi * i / 8;
    const int u = static_cast<int>(std::lround(50 + 30 * std::cos(angle_rad)));
    const int v = static_cast<int>(std::lround(50 + 30 * std::sin(angle_rad)));
    EXPECT_EQ(Red(image, u, v), i % 2 == 0 ? 255 : 0) << i;
  }
}

TEST(Canvas, ImageOfTheRightSizeIsCopied) {
  Image3u8 image(31, 17);
  for (size_t i = 0; i < 3 * image.pixels(); ++i) image.data()[i] = static_cast<uint8_t>(7 * i);
  Canvas canvas(40, 30);
  const PixelRect filled = canvas.DrawImage(image, {5, 6, 31, 17});
  EXPECT_EQ(filled.x, 5);
  EXPECT_EQ(filled.bottom(), 23);
  const Image3u8 drawn = canvas.ToImage();
  for (int v = 0; v < 17; ++v)
    for (int u = 0; u < 31; ++u)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(drawn.at(u + 5, v + 6)[c], image.at(u, v)[c]);
  EXPECT_EQ(drawn.at(4, 10)[0], 0);
  EXPECT_EQ(drawn.at(36, 10)[0], 0);
}

TEST(Canvas, ImageKeepsItsShape) {
  Canvas canvas(100, 100);
  const PixelRect wide = canvas.DrawImage(Image3u8(200, 100, 255), {0, 0, 100, 100});
  EXPECT_EQ(wide.y, 25);
  EXPECT_EQ(wide.width, 100);
  EXPECT_EQ(wide.height, 50);
  const PixelRect small = canvas.DrawImage(Image3u8(10, 20, 255), {0, 0, 100, 100});
  EXPECT_EQ(small.x, 25);
  EXPECT_EQ(small.width, 50);
  EXPECT_EQ(small.height, 100);
}

TEST(Canvas, TextStandsWhereItIsAligned) {
  const auto columns = [](Align align) {
    Canvas canvas(200, 40);
    canvas.Text({100, 25}, "docking", 16, kRed, align);
    const Image3u8 image = canvas.ToImage();
    std::pair<int, int> range(1000, -1);
    for (int u = 0; u < 200; ++u)
      for (int v = 0; v < 40; ++v)
        if (Red(image, u, v) > 100) range = {std::min(range.first, u), std::max(range.second, u)};
    return range;
  };
  const double width = Canvas(1, 1).TextWidth("docking", 16);
  EXPECT_GT(width, 40);
  EXPECT_NEAR(columns(Align::kLeft).first, 100, 3);
  EXPECT_NEAR(columns(Align::kRight).second, 100, 3);
  EXPECT_NEAR(columns(Align::kCenter).first, 100 - width / 2, 3);
}

}  // namespace
}  // namespace turbidock::media
