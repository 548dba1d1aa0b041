// A lit ball in milk against light that scatters as often as it likes: walks from the camera until
// they meet the ball (Monte Carlo), with formulas of their own.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "sim/base/random.h"
#include "sim/light/scattering.h"
#include "tests/light/turns.h"

namespace turbidock::light {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi, kRadius_m = 0.025;

// Green light.
struct Milk {
  double a_per_m, b_per_m, g;
  double c_per_m() const { return a_per_m + b_per_m; }
};

// How far to the ball along a ray.
std::optional<double> Hit(const Vector3d& p, const Vector3d& u, const Vector3d& ball) {
  const Vector3d to = p - ball;
  const double along = to.dot(u), within = along * along - to.squaredNorm() + kRadius_m * kRadius_m;
  if (within <= 0 || -along - std::sqrt(within) <= 0) return {};
  return -along - std::sqrt(within);
}

// Of radiance 1 of the ball, what comes along a ray after it turned at least once.
double Walked(const Milk& milk, const Vector3d& u, const Vector3d& ball, int walks, Rng rng) {
  double sum = 0;
  for (int i = 0; i < walks; ++i) {
    Vector3d p = Vector3d::Zero(), way = u;
    const std::optional<double> first = Hit(p, way, ball);
    // the first turn comes before the ball, whatever the chance
    double weight = first ? 1 - std::exp(-milk.c_per_m() * *first) : 1;
    double step_m = -std::log(1 - rng.Uniform() * weight) / milk.c_per_m();
    // farther away none comes back
    while ((p - ball / 2).norm() < 2) {
      p += step_m * way;
      weight *= milk.b_per_m / milk.c_per_m();
      way = testing::Turned(way, testing::HenyeyGreenstein(milk.g, &rng), &rng);
      step_m = -std::log(1 - rng.Uniform()) / milk.c_per_m();
      const std::optional<double> hit = Hit(p, way, ball);
      if (hit && step_m > *hit) {
        sum += weight;
        break;
      }
    }
  }
  return sum / walks;
}

double Modelled(const Milk& milk, double distance_m, double offset_m) {
  Medium medium;
  medium.absorption_per_m.setConstant(milk.a_per_m);
  medium.scattering_per_m.setConstant(milk.b_per_m);
  medium.asymmetry.setConstant(milk.g);
  medium.multiple_scattering = true;
  const Glow glow{.radius_m = kRadius_m,
                  .intensity_w_sr = Rgb::Constant(kPi * kRadius_m * kRadius_m)};
  const double end_m = offset_m < kRadius_m
                           ? distance_m - std::sqrt(kRadius_m * kRadius_m - offset_m * offset_m)
                           : 100;
  return HaloAlongRay(medium, medium.halo_loss_per_m(), SeenFrom(distance_m, medium, glow),
                      distance_m, offset_m, {0, end_m}, 2000)[1];
}

// In the default milk, at the place of the ring that F compares a ball with.
TEST(HaloWalk, RingsAreAsBright) {
  const struct {
    double distance_m, milk_ml_m3;
  } cases[] = {{0.4, 60}, {0.4, 119}, {0.8, 40}, {0.8, 80}, {1, 30}, {1, 60}};
  const WaterParams water;
  for (const auto& [distance_m, milk_ml_m3] : cases)
    for (const double radii : {1.2, 1.7}) {
      const Milk milk{.a_per_m = 0.045,
                      .b_per_m = water.milk_scattering_m2_ml[1] * milk_ml_m3,
                      .g = water.milk_asymmetry[1]};
      const double sine = radii * kRadius_m / distance_m;
      const double walked = Walked(milk, {std::sqrt(1 - sine * sine), sine, 0}, {distance_m, 0, 0},
                                   60000, SeedTree(1).Stream("walks"));
      EXPECT_NEAR(Modelled(milk, distance_m, radii * kRadius_m) / walked, 1, 0.15)
          << distance_m << " " << milk_ml_m3 << " " << radii;
    }
}

}  // namespace
}  // namespace turbidock::light
