#include <gtest/gtest.h>

#include <cmath>

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
