// The GL context and the spectator's picture.

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "sim/base/check.h"
#include "sim/base/frames.h"
#include "sim/base/units.h"
#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::view {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::PosedScene;

TEST(OsmesaContext, SaysWhatDraws) {
  const auto gl = MakeOsmesaContext();
  EXPECT_THAT(gl->description(), HasSubstr("OSMesa, "));
  EXPECT_THAT(gl->description(), HasSubstr("OpenGL "));
  EXPECT_THAT(gl->description(), HasSubstr("Mesa "));
}

TEST(OsmesaContext, DrawsInTheCallingThread) {
  setenv("LP_NUM_THREADS", "7", 1);
  const auto gl = MakeOsmesaContext();
  EXPECT_STREQ(std::getenv("LP_NUM_THREADS"), "0");
}

TEST(OsmesaContext, MakesWayForAnother) {
  auto a = MakeOsmesaContext();
  const auto current =
      reinterpret_cast<void* (*)()>(dlsym(RTLD_DEFAULT, "OSMesaGetCurrentContext"));
  ASSERT_NE(current, nullptr);
  const void* const of_a = current();
  ASSERT_NE(of_a, nullptr);
  const auto b = MakeOsmesaContext();
  const void* const of_b = current();
  EXPECT_NE(of_b, of_a);
  a->MakeCurrent();
  EXPECT_EQ(current(), of_a);
  b->MakeCurrent();
  EXPECT_EQ(current(), of_b);

  // The one that goes is not current any more; the other draws on.
  a->MakeCurrent();
  a.reset();
  EXPECT_EQ(current(), nullptr);
  PosedScene posed("sea_active");
  posed.Place(Pose::Translation(0.8, 0, 0));
  StereoRenderer renderer(*b, posed.scene);
  RenderedStereo rendered;
  renderer.Render(*posed.data, &rendered);
  EXPECT_EQ(current(), of_b);
  EXPECT_EQ(*rendered.left.surface.at(320, 120), posed.Geom("station_plate") + 1);
}

// In a process of its own that finds only broken copies of the library.
void RunWithoutOsmesa() {
  try {
    MakeOsmesaContext();
  } catch (const SimulatorFault& fault) {
    std::fputs(fault.what(), stderr);
    std::exit(4);
  }
  std::exit(0);
}

TEST(OsmesaContextDeathTest, NamesThePackageWhenTheLibraryIsMissing) {
  GTEST_FLAG_SET(death_test_style,
                 "threadsafe");  // starts a new process, which reads LD_LIBRARY_PATH
  const std::filesystem::path folder = ::testing::TempDir() + "no_osmesa";
  std::filesystem::create_directories(folder);
  for (const char* name : {"libOSMesa.so.8", "libOSMesa.so"})
    std::ofstream(folder / name) << "not a library";
  const char* old = std::getenv("LD_LIBRARY_PATH");
  const std::string before = old ? old : "";
  setenv("LD_LIBRARY_PATH", (folder.string() + ":" + before).c_str(), 1);
  EXPECT_EXIT(RunWithoutOsmesa(), ::testing::ExitedWithCode(4), "install the package libosmesa6");
  old ? setenv("LD_LIBRARY_PATH", before.c_str(), 1) : unsetenv("LD_LIBRARY_PATH");
}

// The lit picture is upright, not mirrored, and in RGB order: each ball is where the camera
// projects it and has its own colour.
class SpectatorView : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, SpectatorView,
                         ::testing::Values("pool_active", "pool_passive", "sea_active",
                                           "sea_passive"),
                         [](const auto& tested) { return tested.param; });

TEST_P(SpectatorView, ShowsTheBalls) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed(GetParam());
  posed.Place(Pose::Translation(0.6, 0, 0));
  constexpr int kWidth = 480, kHeight = 360;
  SpectatorRenderer renderer(*gl, posed.scene, kWidth, kHeight);
  Image3u8 picture;
  const int spectator = posed.scene.spectator_camera;
  renderer.Render(*posed.data, spectator, &picture);
  ASSERT_EQ(picture.width(), kWidth);
  ASSERT_EQ(picture.height(), kHeight);

  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Matrix3d R_WG = Eigen::Map<const RowMajor>(posed.data->cam_xmat + 9 * spectator);
  const Pose X_WC{Eigen::Quaterniond(Eigen::Matrix3d(R_WG * OpticalFromMujocoCamera())),
                  Eigen::Map<const Vector3d>(posed.data->cam_xpos + 3 * spectator)};
  const double fovy_rad = units::RadFromDeg(posed.scene.model->cam_fovy[spectator]);
  const CameraIntrinsics camera = CameraIntrinsics::FromHorizontalFov(
      kWidth, kHeight, 2 * std::atan(std::tan(fovy_rad / 2) * kWidth / kHeight));
  for (const vehicle::BallInScene& ball : posed.scene.balls) {
    const Eigen::Vector2d px = camera.Project(X_WC.Inverse() * (posed.scene.X_WM * ball.p_MQ));
    const int u = static_cast<int>(std::lround(px.x())), v = static_cast<int>(std::lround(px.y()));
    ASSERT_TRUE(picture.Contains(u, v)) << ball.name;
    const uint8_t* rgb = picture.at(u, v);
    const int own = static_cast<int>(std::string("rgb").find(ball.name[0]));
    for (int i = 0; i < 3; ++i)
      EXPECT_TRUE(i == own || rgb[own] > 2 * rgb[i]) << ball.name << " at " << u << " " << v;
    EXPECT_GT(rgb[own], 60) << ball.name;
  }

  // The docking vehicle is in the picture and bright enough to see.
  int bright = 0;
  for (size_t i = 0; i < picture.pixels(); ++i) {
    const uint8_t* rgb = picture.data() + 3 * i;
    bright += rgb[0] > 110 && rgb[1] > 80 && rgb[2] < 60;  // the yellow floats
  }
  EXPECT_GT(bright, 2000);
}

}  // namespace
}  // namespace turbidock::view
