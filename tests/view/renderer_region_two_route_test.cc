// A region drawn by itself against the same part of the whole picture.
#include <gtest/gtest.h>

#include "sim/base/random.h"
#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::view {
namespace {

using testing::PosedScene;

TEST(StereoRenderer, DrawsARegionAsInTheWhole) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("sea_passive");
  StereoRenderer renderer(*gl, posed.scene);
  Rng rng = SeedTree(8).Stream("regions");
  const int width = posed.scene.rig.left.width_px, height = posed.scene.rig.left.height_px;
  const auto any = [&] {
    PixelRegion r;
    r.column_begin = static_cast<int>(rng.Below(static_cast<uint32_t>(width)));
    r.row_begin = static_cast<int>(rng.Below(static_cast<uint32_t>(height)));
    r.column_end = r.column_begin +
                   static_cast<int>(rng.Below(static_cast<uint32_t>(width - r.column_begin + 1)));
    r.row_end =
        r.row_begin + static_cast<int>(rng.Below(static_cast<uint32_t>(height - r.row_begin + 1)));
    return r;
  };
  int64_t inside = 0;
  RenderedStereo whole, part;
  for (int i = 0; i < 16; ++i) {
    posed.Place(Pose{FromYawPitchRoll(rng.Uniform(-0.2, 0.2), 0.05, 0.02),
                     {rng.Uniform(0.3, 1.2), 0.03, -0.02}});
    renderer.Render(*posed.data, &whole);
    const StereoRegion region = {any(), any()};
    constexpr uint16_t kBefore = 60000;
    for (RenderedView* view : {&part.left, &part.right}) {
      view->surface = Image1u16(width, height, kBefore);
      view->depth_m = Image1f(width, height, -1);
    }
    renderer.Render(*posed.data, region, &part);
    const auto compare = [&](const PixelRegion& r, const RenderedView& got,
                             const RenderedView& expected) {
      int wrong = 0;
      for (int v = 0; v < height; ++v)
        for (int u = 0; u < width; ++u) {
          const bool in = r.Contains(u, v);
          inside += in;
          wrong += *got.surface.at(u, v) != (in ? *expected.surface.at(u, v) : kBefore);
          wrong += *got.depth_m.at(u, v) != (in ? *expected.depth_m.at(u, v) : -1);
        }
      EXPECT_EQ(wrong, 0) << i;
    };
    compare(region.left, part.left, whole.left);
    compare(region.right, part.right, whole.right);
  }
  EXPECT_GT(inside, 500000);
}

}  // namespace
}  // namespace turbidock::view
