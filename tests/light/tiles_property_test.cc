// Tiles whatever the picture's size and whatever is seen in it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "sim/base/random.h"
#include "sim/light/tiles.h"

namespace turbidock::light {
namespace {

// Patches of three surfaces and of none, and single pixels of others.
Image1u16 Patches(int width, int height, Rng* rng) {
  Image1u16 surface(width, height, 1);
  for (int patch = 0; patch < 6; ++patch) {
    const int u0 = static_cast<int>(rng->Below(width)), v0 = static_cast<int>(rng->Below(height));
    const auto id = static_cast<uint16_t>(rng->Below(4));
    for (int v = v0; v < std::min(height, v0 + 17); ++v)
      for (int u = u0; u < std::min(width, u0 + 21); ++u) *surface.at(u, v) = id;
  }
  for (int pixel = 0; pixel < 5; ++pixel)
    *surface.at(static_cast<int>(rng->Below(width)), static_cast<int>(rng->Below(height))) = 9;
  return surface;
}

TEST(SurfacePyramid, SaysWhichSurfaceASquareShows) {
  Rng rng = SeedTree(31).Stream("patches");
  int single = 0, mixed = 0;
  SurfacePyramid pyramid;
  for (const auto& [width, height] : {std::pair{64, 48}, {61, 43}, {33, 70}, {4, 5}})
    for (int round = 0; round < 8; ++round) {
      const Image1u16 surface = Patches(width, height, &rng);
      const PixelRegion whole{0, 0, width, height};
      const PixelRegion part{width / 3, height / 4, width - width / 5, height - height / 5};
      for (const PixelRegion& region : {whole, part}) {
        pyramid.Build(surface, region);
        for (int size = SurfacePyramid::kCell_px; size <= 32; size *= 2)
          for (int v0 = 0; v0 < height; v0 += size)
            for (int u0 = 0; u0 < width; u0 += size) {
              // the squares that lie in the region, as far as they lie in the picture
              const int u1 = std::min(u0 + size, width), v1 = std::min(v0 + size, height);
              if (u0 < region.column_begin || u1 > region.column_end || v0 < region.row_begin ||
                  v1 > region.row_end)
                continue;
              std::set<uint16_t> shown;
              for (int v = v0; v < v1; ++v)
                for (int u = u0; u < u1; ++u) shown.insert(*surface.at(u, v));
              const uint16_t expected = shown.size() == 1 ? *shown.begin() : SurfacePyramid::kMixed;
              ASSERT_EQ(pyramid.At(u0, v0, size), expected)
                  << width << " x " << height << ": " << size << " at " << u0 << ", " << v0;
              ++(shown.size() == 1 ? single : mixed);
            }
      }
    }
  EXPECT_GT(single, 1000);
  EXPECT_GT(mixed, 1000);
}

// Light that is linear over the picture.
Light LinearLight(double u, double v) {
  return Light(static_cast<float>(1 + 0.02 * u + 0.01 * v), static_cast<float>(3 - 0.02 * u),
               static_cast<float>(0.5 + 0.03 * v), 0);
}

// Tiles are exact where light is linear, in a picture and a region of any size, and need fewer
// points than there are pixels; fewer still if a tile may show several surfaces.
TEST(TiledLight, IsExactWhereLightIsLinear) {
  constexpr int kBand = TiledLight::kBandRows;
  Rng rng = SeedTree(32).Stream("patches");
  TiledLight tiles;
  SurfacePyramid pyramid;
  for (const auto& [width, height] : {std::pair{64, 48}, {61, 45}, {33, 70}, {65, 33}, {5, 1}}) {
    const Image1u16 surface = Patches(width, height, &rng);
    const Image1f depth_m(width, height, 1.0f);
    const PixelRegion whole{0, 0, width, height};
    const PixelRegion part{width / 3, height / 4, width - width / 5, height};
    for (const PixelRegion& region : {whole, part}) {
      pyramid.Build(surface, region);
      int64_t points[2];
      for (const bool may_be_mixed : {false, true}) {
        tiles.Spread(surface, depth_m, pyramid, region,
                     {.largest_px = 16, .mixed_px = may_be_mixed ? 16 : 0},
                     [](std::span<const LightPoint> at, Light* light) {
                       for (const LightPoint& p : at) *light++ = LinearLight(p.u, p.v);
                     });
        points[may_be_mixed] = tiles.points();
        for (int band = region.row_begin / kBand * kBand; band < region.row_end; band += kBand) {
          const int rows = std::min(kBand, height - band);
          std::vector<float> rgb(static_cast<size_t>(3 * width * rows), 1.0f);
          for (const auto mode : {TiledLight::Mode::kWrite, TiledLight::Mode::kAdd}) {
            tiles.Paint(band, band + rows, mode, rgb.data());
            const float times = mode == TiledLight::Mode::kAdd ? 2 : 1;
            for (int v = std::max(band, region.row_begin);
                 v < std::min(band + rows, region.row_end); ++v)
              for (int u = region.column_begin; u < region.column_end; ++u)
                for (int k = 0; k < 3; ++k)
                  ASSERT_NEAR(rgb[static_cast<size_t>((3 * (v - band) + k) * width + u)],
                              times * LinearLight(u, v)[k], 2e-5)
                      << width << " x " << height << ": " << u << ", " << v;
          }
        }
      }
      if (width > 30) {
        EXPECT_LT(points[1], points[0]);
        EXPECT_LT(points[1], region.width() * region.height() / 10);
      }
    }
  }
}

}  // namespace
}  // namespace turbidock::light
