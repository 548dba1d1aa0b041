// What EGL draws against what OSMesa draws, each in a process of its own.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "sim/base/frames.h"
#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::view {
namespace {

using testing::PosedScene;

// llvmpipe draws the same either way; a GPU may decide otherwise about pixels on an edge, and
// rounds vertices and depth in its own way (NVIDIA H100: 2.0e-4 z^2 at most).
constexpr double kDifferentSurfaceShare = 1e-3;
constexpr double kDepthTol_m = 5e-4;  // times z^2

std::vector<Pose> Poses() {
  return {Pose::Translation(1.3, 0.2, 0.1), Pose::Translation(0.36, 0.03, -0.02),
          Pose{FromYawPitchRoll(0.3, 0.1, -0.2), {0.6, -0.1, 0.05}}};
}

std::vector<RenderedView> Draw(GlContext& gl, PosedScene* posed) {
  StereoRenderer renderer(gl, posed->scene);
  std::vector<RenderedView> views;
  for (const Pose& X_HM : Poses()) {
    posed->Place(X_HM);
    RenderedStereo rendered;
    renderer.Render(*posed->data, &rendered);
    views.push_back(rendered.left);
    views.push_back(rendered.right);
  }
  return views;
}

std::string PixelFile(const std::string& model) { return ::testing::TempDir() + model + ".egl"; }

// The child's part: draws with EGL, into a file.
[[noreturn]] void DrawWithEgl(const std::string& model) {
  PosedScene posed(model);
  const auto gl = MakeEglContext();
  std::ofstream file(PixelFile(model), std::ios::binary);
  for (const RenderedView& view : Draw(*gl, &posed)) {
    const auto pixels = static_cast<std::streamsize>(view.surface.pixels());
    file.write(reinterpret_cast<const char*>(view.surface.data()), 2 * pixels);
    file.write(reinterpret_cast<const char*>(view.depth_m.data()), 4 * pixels);
  }
  file.close();
  std::fputs(gl->description().c_str(), stderr);
  std::exit(file ? 0 : 1);
}

// In a process of its own from its beginning.
class EglAgainstOsmesaDeathTest : public ::testing::TestWithParam<const char*> {
 protected:
  EglAgainstOsmesaDeathTest() { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};
INSTANTIATE_TEST_SUITE_P(Models, EglAgainstOsmesaDeathTest,
                         ::testing::Values("pool_passive", "sea_active"),
                         [](const auto& tested) { return tested.param; });

TEST_P(EglAgainstOsmesaDeathTest, SameSurfaceSameDepth) {
  EXPECT_EXIT(DrawWithEgl(GetParam()), ::testing::ExitedWithCode(0), "EGL, .*OpenGL ");
  PosedScene posed(GetParam());
  const auto gl = MakeOsmesaContext();
  std::ifstream file(PixelFile(GetParam()), std::ios::binary);
  for (const RenderedView& osmesa : Draw(*gl, &posed)) {
    RenderedView egl = osmesa;
    const auto pixels = static_cast<std::streamsize>(egl.surface.pixels());
    file.read(reinterpret_cast<char*>(egl.surface.data()), 2 * pixels);
    file.read(reinterpret_cast<char*>(egl.depth_m.data()), 4 * pixels);
    ASSERT_TRUE(file);
    int different = 0, marker = 0;
    double worst = 0;  // depth difference over z^2
    for (size_t pixel = 0; pixel < egl.surface.pixels(); ++pixel) {
      const int surface = osmesa.surface.data()[pixel];
      marker += surface != 0 && posed.GeomName(surface - 1).starts_with("ball_");
      if (egl.surface.data()[pixel] != surface) {
        ++different;
      } else if (surface != 0) {
        const double z_m = osmesa.depth_m.data()[pixel];
        worst = std::max(worst, std::abs(egl.depth_m.data()[pixel] - z_m) / (z_m * z_m));
      }
    }
    EXPECT_LE(different, kDifferentSurfaceShare * static_cast<double>(pixels));
    EXPECT_LE(worst, kDepthTol_m);
    EXPECT_GT(marker, 200);  // there was something to compare
  }
}

// Two contexts of one process: each draws on when the other goes.
[[noreturn]] void DrawWithTwo() {
  PosedScene posed("sea_active");
  posed.Place(Pose::Translation(0.8, 0, 0));
  auto a = MakeEglContext();
  auto b = MakeEglContext();
  StereoRenderer of_a(*a, posed.scene);
  RenderedStereo first, second, third;
  of_a.Render(*posed.data, &first);
  {
    StereoRenderer of_b(*b, posed.scene);
    of_b.Render(*posed.data, &second);
  }
  b.reset();
  of_a.Render(*posed.data, &third);
  const bool same = second.left.surface == first.left.surface &&
                    third.left.surface == first.left.surface &&
                    third.right.depth_m == first.right.depth_m;
  std::exit(same ? 0 : 1);
}

TEST(EglContextDeathTest, MakesWayForAnother) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(DrawWithTwo(), ::testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace turbidock::view
