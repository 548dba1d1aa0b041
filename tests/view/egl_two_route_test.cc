// What EGL draws against what OSMesa draws, each in a process of its own.

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::view {
namespace {

using testing::PosedScene;

Image3u8 Draw(GlContext& gl, const std::string& model) {
  PosedScene posed(model);
  posed.Place(Pose{FromYawPitchRoll(0.3, 0.1, -0.2), {0.6, -0.1, 0.05}});
  SpectatorRenderer renderer(gl, posed.scene, 320, 240);
  Image3u8 picture;
  renderer.Render(*posed.data, posed.scene.spectator_camera, &picture);
  return picture;
}

std::string PixelFile(const std::string& model) { return ::testing::TempDir() + model + ".egl"; }

// The child's part: draws with EGL, into a file.
[[noreturn]] void DrawWithEgl(const std::string& model) {
  const auto gl = MakeEglContext();
  const Image3u8 picture = Draw(*gl, model);
  std::ofstream file(PixelFile(model), std::ios::binary);
  file.write(reinterpret_cast<const char*>(picture.data()),
             static_cast<std::streamsize>(3 * picture.pixels()));
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

// llvmpipe draws the same either way; a GPU may decide otherwise about pixels on an edge.
TEST_P(EglAgainstOsmesaDeathTest, SamePicture) {
  EXPECT_EXIT(DrawWithEgl(GetParam()), ::testing::ExitedWithCode(0), "EGL, .*OpenGL ");
  const auto gl = MakeOsmesaContext();
  const Image3u8 osmesa = Draw(*gl, GetParam());
  Image3u8 egl = osmesa;
  std::ifstream file(PixelFile(GetParam()), std::ios::binary);
  file.read(reinterpret_cast<char*>(egl.data()), static_cast<std::streamsize>(3 * egl.pixels()));
  ASSERT_TRUE(file);
  size_t different = 0, lit = 0;
  for (size_t i = 0; i < 3 * egl.pixels(); ++i) {
    different += std::abs(egl.data()[i] - osmesa.data()[i]) > 2;
    lit += osmesa.data()[i] > 60;
  }
  EXPECT_LE(different, egl.pixels() / 100);
  EXPECT_GT(lit, 1000u);  // there was something to compare
}

// Two contexts of one process: each draws on when the other goes.
[[noreturn]] void DrawWithTwo() {
  auto a = MakeEglContext();
  auto b = MakeEglContext();
  const Image3u8 first = Draw(*a, "sea_active"), second = Draw(*b, "sea_active");
  b.reset();
  std::exit(second == first && Draw(*a, "sea_active") == first ? 0 : 1);
}

TEST(EglContextDeathTest, MakesWayForAnother) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(DrawWithTwo(), ::testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace turbidock::view
