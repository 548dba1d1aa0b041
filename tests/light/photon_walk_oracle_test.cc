// The water model against light that scatters as often as it likes: walks from the camera back to
// the lamps (Monte Carlo), with formulas of their own.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "sim/base/random.h"
#include "sim/light/water.h"
#include "tests/light/optics_scene.h"
#include "tests/light/turns.h"

namespace turbidock::light {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

// Green light in the pool: pure water and milk.
struct Milk {
  double a_per_m = 0.045, b_per_m = 0, g = WaterParams{}.milk_asymmetry[1];
  double c_per_m() const { return a_per_m + b_per_m; }
};

// Radiance that met no surface on its way, and that did.
struct SeenLight {
  double veil = 0, marker = 0;
};

struct Geometry {
  const char* name;
  double back_m, exponent;  // lamps behind the cameras, cos^m
};

class PhotonWalk {
 public:
  // `most`: the walk ends after so many turns; one is single scattering.
  PhotonWalk(const Milk& milk, std::vector<Surface> surfaces, const Geometry& geometry, int most)
      : milk_(milk), surfaces_(std::move(surfaces)), exponent_(geometry.exponent), most_(most) {
    for (const double y_m : {0.16, -0.16}) lamps_.emplace_back(-geometry.back_m, y_m, 0);
  }

  SeenLight Mean(const Vector3d& p, const Vector3d& u, int walks, Rng rng) const {
    SeenLight sum;
    for (int i = 0; i < walks; ++i) Walk(p, u, &rng, &sum);
    return {sum.veil / walks, sum.marker / walks};
  }

 private:
  static constexpr double kLens_m = 0.017;

  // The nearest surface along a ray, -1: none.
  std::pair<int, double> Hit(const Vector3d& p, const Vector3d& u) const {
    std::pair<int, double> hit{-1, std::numeric_limits<double>::infinity()};
    for (int i = 0; i < static_cast<int>(surfaces_.size()); ++i) {
      const Surface& s = surfaces_[static_cast<size_t>(i)];
      const double t = testing::RayDistance(s, p - s.X_AS.p, u);
      if (t < hit.second) hit = {i, t};
    }
    return hit;
  }

  // Of a lamp at p: I(alpha) / d^2 exp(-c d) share(direction of the light).
  double FromLamp(const Vector3d& lamp, const Vector3d& p, auto&& share) const {
    // a lens of 17 mm, not a point
    const double d_m = std::max(kLens_m, (p - lamp).norm());
    const Vector3d e = (p - lamp) / d_m;
    const double weight = e.x() > 0 ? share(e) : 0;
    if (weight <= 0 || Hit(p, -e).second <= d_m) return 0;
    return weight * std::pow(e.x(), exponent_) / (d_m * d_m) * std::exp(-milk_.c_per_m() * d_m);
  }

  double Phase(double cosine) const {
    const double g = milk_.g;
    return (1 - g * g) / (4 * kPi) * std::pow(1 + g * g - 2 * g * cosine, -1.5);
  }

  // What the water on the first `range_m` of a ray scatters into it: for each lamp, of one place,
  // drawn evenly in the angle at which the lamp sees it (Kulla & Fajardo 2012). Places drawn by how
  // far light goes seldom come near a lamp, and count for much if they do.
  double AlongRay(const Vector3d& p, const Vector3d& u, double range_m, Rng* rng) const {
    double sum = 0;
    for (const Vector3d& lamp : lamps_) {
      const double foot_m = (lamp - p).dot(u);
      const double offset_m = std::max(kLens_m, (lamp - p - foot_m * u).norm());
      const double first_rad = std::atan2(-foot_m, offset_m);
      const double angles_rad = std::atan2(range_m - foot_m, offset_m) - first_rad;
      const double tangent = std::tan(first_rad + angles_rad * rng->Uniform());
      const double along_m = foot_m + offset_m * tangent;
      const double density_per_m = 1 / (angles_rad * offset_m * (1 + tangent * tangent));
      sum += std::exp(-milk_.c_per_m() * along_m) / density_per_m *
             FromLamp(lamp, p + along_m * u, [&](const Vector3d& e) { return Phase(-e.dot(u)); });
    }
    return milk_.b_per_m * sum;
  }

  void Walk(Vector3d p, Vector3d u, Rng* rng, SeenLight* sum) const {
    constexpr double kFarthest_m = 100;
    double weight = 1;
    bool touched = false;
    for (int turn = 0; turn < most_ && weight > 0; ++turn) {
      const auto [surface, range_m] = Hit(p, u);
      (touched ? sum->marker : sum->veil) +=
          weight * AlongRay(p, u, std::min(range_m, kFarthest_m), rng);
      const double free_m = -std::log(1 - rng->Uniform()) / milk_.c_per_m();
      p += std::min(free_m, range_m) * u;
      if (free_m < range_m) {
        weight *= milk_.b_per_m / milk_.c_per_m();
        u = testing::Turned(u, testing::HenyeyGreenstein(milk_.g, rng), rng);
      } else {
        touched = true;
        const Surface& s = surfaces_[static_cast<size_t>(surface)];
        const Vector3d n = Normal(s, p - s.X_AS.p);
        p += 1e-9 * n;
        weight *= s.albedo[1];
        for (const Vector3d& lamp : lamps_)
          sum->marker +=
              weight / kPi * FromLamp(lamp, p, [&](const Vector3d& e) { return -e.dot(n); });
        u = testing::Turned(n, std::sqrt(rng->Uniform()), rng);
      }
      if (weight < 0.1) weight = rng->Uniform() < weight / 0.1 ? 0.1 : 0;
    }
  }

  static Vector3d Normal(const Surface& s, const Vector3d& p_S) {
    if (s.shape == Shape::kSphere) return p_S.normalized();
    Vector3d::Index axis = 0;
    p_S.cwiseQuotient(s.size_m).cwiseAbs().maxCoeff(&axis);
    return std::copysign(1.0, p_S[axis]) * Vector3d::Unit(axis);
  }

  Milk milk_;
  std::vector<Surface> surfaces_;  // not turned
  double exponent_;
  int most_;
  std::vector<Vector3d> lamps_;
};

// The water model's, at one pixel of the left camera.
SeenLight Modelled(double milk_ml_m3, std::vector<Surface> surfaces, const Geometry& geometry,
                   bool multiple, const Vector3d& pixel) {
  OpticsParams params;
  params.shading.tile_px = 1;
  params.ball_lights.enabled = false;
  params.lamps.enabled = true;
  params.lamps.intensity_w_sr.setOnes();
  params.lamps.cosine_exponent = geometry.exponent;
  params.water.milk_ml_m3 = milk_ml_m3;
  params.water.multiple_scattering = multiple;
  params.water.surface_halos = multiple;
  params.water.port_m = 0;
  std::vector<Pose> lamps = testing::LampsAt(0.16);
  for (Pose& X_HE : lamps) X_HE.p.x() = -geometry.back_m;
  const StereoRig rig = testing::SmallRig();
  const auto green = [&] {
    Water water(params, rig, SurfaceTable(surfaces), lamps);
    RadianceStereo out;
    water.Apply(testing::Cast(surfaces, rig), &out);
    return double{out.left.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()))[1]};
  };
  const double all = green();
  for (Surface& s : surfaces) s.albedo.setZero();
  const double veil = green();
  return {veil, all - veil};
}

// The model's over the walks', of a point of the marker that is seen.
struct Ratios {
  double veil, marker;
};

Ratios Compare(double milk_ml_m3, double distance_m, const Vector3d& p_MQ, const Geometry& geometry,
               bool multiple, int walks, int most) {
  std::vector<Surface> surfaces = testing::MarkerAndPlate(Pose::Translation(distance_m, 0, 0));
  surfaces.pop_back();  // the plate
  const MountedCamera camera = testing::SmallRig().left;
  const Vector3d p_C = camera.X_HC.Inverse() * (Vector3d(distance_m, 0, 0) + p_MQ);
  const Vector3d pixel(std::round(camera.cx_px + camera.fx_px * p_C.x() / p_C.z()),
                       std::round(camera.cy_px + camera.fy_px * p_C.y() / p_C.z()), 0);
  const Vector3d ray_C = camera.RayAt(pixel.x(), pixel.y());
  const SeenLight walked =
      PhotonWalk({.b_per_m = WaterParams{}.milk_scattering_m2_ml[1] * milk_ml_m3}, surfaces,
                 geometry, most)
          .Mean(camera.X_HC.p, camera.X_HC.q * ray_C.normalized(), walks,
                SeedTree(1).Stream("walks"));
  const SeenLight model = Modelled(milk_ml_m3, surfaces, geometry, multiple, pixel);
  const double veil = model.veil / walked.veil, marker = model.marker / walked.marker;
  return {veil, marker};
}

constexpr Geometry kBeside{"beside", 0, 1}, kBehind{"behind", 0.1, 4};
const Vector3d kBall(-0.09, 0, 0), kBox(-0.05, 0.035, -0.035);

// Walks of one turn are single scattering itself: they and the model must agree.
TEST(PhotonWalk, OfOneTurnIsSingleScattering) {
  for (const Geometry& geometry : {kBeside, kBehind})
    for (const double milk_ml_m3 : {20, 119})
      for (const Vector3d& p_MQ : {kBall, kBox}) {
        const Ratios r = Compare(milk_ml_m3, 0.4, p_MQ, geometry, false, 40000, 1);
        EXPECT_NEAR(r.veil, 1, 0.05) << geometry.name << milk_ml_m3;
        EXPECT_NEAR(r.marker, 1, 0.05) << geometry.name << milk_ml_m3;
      }
}

// Veil and marker are good to 15 % in milk in which the marker can be found, to 25 % beyond.
TEST(PhotonWalk, ModelAgainstAllTurns) {
  const struct {
    double distance_m, milk_ml_m3, bound;
    int walks;
  } cases[] = {{0.4, 20, 0.15, 40000},
               {0.4, 60, 0.15, 160000},
               {0.4, 119, 0.25, 160000},
               {1, 20, 0.15, 40000}};
  for (const auto& c : cases)
    for (const Geometry& geometry : {kBeside, kBehind})
      for (const Vector3d& p_MQ : {kBall, kBox}) {
        const Ratios r = Compare(c.milk_ml_m3, c.distance_m, p_MQ, geometry, true, c.walks, 1000);
        EXPECT_NEAR(r.veil, 1, c.bound) << geometry.name << " " << c.milk_ml_m3;
        EXPECT_NEAR(r.marker, 1, c.bound) << geometry.name << " " << c.milk_ml_m3;
      }
}

}  // namespace
}  // namespace turbidock::light
