#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "vision/undistort.h"

namespace turbidock::vision {
namespace {

const CameraIntrinsics kCamera = RigParams{}.MakeRig().left;

TEST(LensDistortion, HasOpenCvsValues) {
  // Each term by hand at (0.3, -0.2): r2 = 0.13.
  const Eigen::Vector2d at(0.3, -0.2);
  const double r2 = 0.13;
  EXPECT_NEAR((LensDistortion{.k1 = 0.1}.Apply(at) - at * (1 + 0.1 * r2)).norm(), 0, 1e-15);
  EXPECT_NEAR((LensDistortion{.k2 = 0.1}.Apply(at) - at * (1 + 0.1 * r2 * r2)).norm(), 0, 1e-15);
  EXPECT_NEAR((LensDistortion{.k3 = 0.1}.Apply(at) - at * (1 + 0.1 * r2 * r2 * r2)).norm(), 0,
              1e-15);
  EXPECT_NEAR((LensDistortion{.k4 = 0.1}.Apply(at) - at / (1 + 0.1 * r2)).norm(), 0, 1e-15);
  const Eigen::Vector2d p1(0.1 * 2 * 0.3 * -0.2, 0.1 * (r2 + 2 * 0.04));
  const Eigen::Vector2d p2(0.1 * (r2 + 2 * 0.09), 0.1 * 2 * 0.3 * -0.2);
  EXPECT_NEAR((LensDistortion{.p1 = 0.1}.Apply(at) - at - p1).norm(), 0, 1e-15);
  EXPECT_NEAR((LensDistortion{.p2 = 0.1}.Apply(at) - at - p2).norm(), 0, 1e-15);
  const Eigen::Vector2d s(0.1 * r2 + 0.2 * r2 * r2, 0.3 * r2 + 0.4 * r2 * r2);
  EXPECT_NEAR(
      (LensDistortion{.s1 = 0.1, .s2 = 0.2, .s3 = 0.3, .s4 = 0.4}.Apply(at) - at - s).norm(), 0,
      1e-15);
}

// As cv::fisheye::distortPoints has it: 45 degrees off the axis are seen at pi / 4 times a
// polynomial.
TEST(LensDistortion, EquidistantLensHasOpenCvsValues) {
  const double t = std::numbers::pi / 4, t2 = t * t;
  const LensDistortion lens{.equidistant = true, .k1 = 0.1, .k2 = 0.2, .k3 = 0.3, .k4 = 0.4};
  const double seen =
      t * (1 + 0.1 * t2 + 0.2 * t2 * t2 + 0.3 * t2 * t2 * t2 + 0.4 * t2 * t2 * t2 * t2);
  EXPECT_NEAR((lens.Apply({0.6, -0.8}) - seen * Eigen::Vector2d(0.6, -0.8)).norm(), 0, 1e-15);
  EXPECT_EQ(lens.Apply({0, 0}), Eigen::Vector2d(0, 0));
  EXPECT_FALSE(LensDistortion{.equidistant = true}.is_none());
}

TEST(Undistorter, BringsAPictureOfSmoothColoursBack) {
  // What the undistorted camera would see, as a function of the ray; the real one sees it through
  // the lens, whose inverse is found by iteration.
  const LensDistortion lens{.k1 = -0.12, .k2 = 0.03, .p1 = 0.001, .p2 = -0.002};
  const auto scene = [](const Eigen::Vector2d& ray) {
    return 127 + 90 * std::sin(9 * ray.x()) * std::cos(7 * ray.y());
  };
  Image3u8 seen(640, 480), undistorted;
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      const Eigen::Vector2d through = kCamera.RayAt(u, v).head<2>();
      Eigen::Vector2d ray = through;
      for (int i = 0; i < 20; ++i) ray += through - lens.Apply(ray);
      for (int k = 0; k < 3; ++k) seen.at(u, v)[k] = static_cast<uint8_t>(std::lround(scene(ray)));
    }
  undistorted = seen;
  Undistorter(kCamera, lens).Apply(&undistorted);
  double worst = 0;
  for (int v = 20; v < 460; ++v)
    for (int u = 20; u < 620; ++u)
      worst =
          std::max(worst, std::abs(*undistorted.at(u, v) - scene(kCamera.RayAt(u, v).head<2>())));
  EXPECT_LT(worst, 1.6);  // two roundings
  EXPECT_EQ(seen.at(320, 240)[1], undistorted.at(320, 240)[1]);
}

}  // namespace
}  // namespace turbidock::vision
