// Radial distortion against its formula.

#include "sim/camera/lens.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/base/random.h"

namespace turbidock::camera {
namespace {

TEST(Lens, PinholeRadiusInvertsBrown) {
  for (const LensParams& params : {LensParams{-0.2, 0.05}, LensParams{0.1, 0}, LensParams{0, -0.1}})
    for (const double r : {0.0, 0.1, 0.4, 0.72}) {
      const double seen = r * (1 + params.k1 * r * r + params.k2 * std::pow(r, 4));
      EXPECT_NEAR(StereoLens::PinholeRadius(params, seen), r, 1e-12);
    }
}

TEST(Lens, IsNoneUnlessSet) {
  const StereoRig rig = RigParams{}.MakeRig();
  StereoLens none({}, rig);
  EXPECT_FALSE(none.on());
  light::RadianceStereo images{Image3f(640, 480, 0.25f), Image3f(640, 480, 0.5f)};
  *images.left.at(7, 9) = 3;
  const light::RadianceStereo before = images;
  none.Distort(&images);
  EXPECT_EQ(images.left, before.left);
  EXPECT_EQ(images.right, before.right);
}

// What is next to no distortion changes next to nothing, to the last row and column.
TEST(Lens, KeepsTheImagesBorders) {
  const StereoRig rig = RigParams{}.MakeRig();
  Rng rng = SeedTree(1).Stream("image");
  light::RadianceStereo images{Image3f(640, 480), Image3f(640, 480)};
  for (Image3f* image : {&images.left, &images.right})
    for (size_t i = 0; i < 3 * image->pixels(); ++i)
      image->data()[i] = static_cast<float>(rng.Uniform());
  const light::RadianceStereo before = images;
  StereoLens({1e-8, 0}, rig).Distort(&images);
  double farthest = 0;
  for (size_t i = 0; i < 3 * before.left.pixels(); ++i)
    farthest =
        std::max({farthest, std::abs(double{images.left.data()[i]} - double{before.left.data()[i]}),
                  std::abs(double{images.right.data()[i]} - double{before.right.data()[i]})});
  EXPECT_GT(farthest, 0);
  EXPECT_LT(farthest, 1e-4);
}

// A spot is seen where the formula says, in both cameras; what is even stays so.
TEST(Lens, MovesASpotAlongItsRadius) {
  const StereoRig rig = RigParams{}.MakeRig();
  const LensParams params{-0.15, 0.03};
  StereoLens lens(params, rig);
  for (const auto& [u0, v0] : {std::pair{500, 100}, std::pair{60, 400}, std::pair{330, 250}}) {
    light::RadianceStereo images{Image3f(640, 480, 1.0f), Image3f(640, 480, 1.0f)};
    for (int dv = -6; dv <= 6; ++dv)
      for (int du = -6; du <= 6; ++du)
        for (Image3f* image : {&images.left, &images.right})
          image->at(u0 + du, v0 + dv)[1] +=
              static_cast<float>(std::exp(-(du * du + dv * dv) / 8.0));
    lens.Distort(&images);
    const Eigen::Vector2d pinhole = rig.left.RayAt(u0, v0).head<2>();
    const double r2 = pinhole.squaredNorm();
    const Eigen::Vector2d seen = pinhole * (1 + params.k1 * r2 + params.k2 * r2 * r2);
    const Eigen::Vector2d expected_px = rig.left.Project({seen.x(), seen.y(), 1});
    for (const Image3f* image : {&images.left, &images.right}) {
      Eigen::Vector2d sum = Eigen::Vector2d::Zero();
      double weight = 0;
      for (int v = 0; v < 480; ++v)
        for (int u = 0; u < 640; ++u) {
          const double w = static_cast<double>(image->at(u, v)[1]) - 1;
          sum += w * Eigen::Vector2d(u, v);
          weight += w;
          EXPECT_NEAR(image->at(u, v)[0], 1, 1e-6);
        }
      EXPECT_LT((sum / weight - expected_px).norm(), 0.06) << u0 << " " << v0;
    }
  }
}

TEST(Lens, RefusesToFoldTheImage) {
  EXPECT_THROW(StereoLens({-0.9, 0}, RigParams{}.MakeRig()), ConfigError);
  // the pinhole's corner is still in order, the seen one has no light: r (1 - r^2 / 2) <= 0.545
  EXPECT_THROW(StereoLens({-0.5, 0}, RigParams{}.MakeRig()), ConfigError);
  EXPECT_NO_THROW(StereoLens({-0.3, 0.1}, RigParams{}.MakeRig()));
}

}  // namespace
}  // namespace turbidock::camera
