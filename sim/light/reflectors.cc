#include "sim/light/reflectors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace turbidock::light {
namespace {

constexpr const char* kPlate = "station_plate";
// Longest side of a patch. At half the size halos change by 2 % (next to the plate's edge by 5 %).
constexpr double kPatch_m = 0.16;
// Faces smaller than this share of a box's largest one do not count: a plate's edges.
constexpr double kMinShare = 0.2;

void SetPoint(const Eigen::Vector3f& p_H, const Eigen::Vector3f& normal_H, int i,
              PointBatch* batch) {
  batch->x_m[i] = p_H.x(), batch->y_m[i] = p_H.y(), batch->z_m[i] = p_H.z();
  batch->normal_x[i] = normal_H.x();
  batch->normal_y[i] = normal_H.y();
  batch->normal_z[i] = normal_H.z();
}

}  // namespace

Reflectors::Reflectors(const SurfaceTable& surfaces, const Medium& medium) : medium_(medium) {
  for (int geom = 0; geom < surfaces.size(); ++geom) {
    const Surface& surface = surfaces[geom];
    if (!surface.casts_shadow && surface.name != kPlate) continue;
    if (surface.shape == Shape::kBox) AddFaces(geom, surface);
    if (surface.shape != Shape::kSphere) continue;
    const double radius_m = surface.size_m[0];
    Reflector ball;
    ball.geom = geom;
    // a Lambertian sphere that is lit from where it is seen
    ball.per_irradiance_m2_sr =
        (2.0 / 3.0 * radius_m * radius_m * surface.albedo.array()).cast<float>();
    ball.halo = Halo(radius_m, /*disc=*/false);
    ball.glow.radius_m = radius_m;
    reflectors_.push_back(std::move(ball));
  }
}

void Reflectors::AddFaces(int geom, const Surface& box) {
  const Eigen::Vector3d side_m = 2 * box.size_m;
  const double largest_m2 = side_m.prod() / side_m.minCoeff();
  for (int axis = 0; axis < 3; ++axis) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    if (side_m[a] * side_m[b] < kMinShare * largest_m2) continue;
    const int columns = static_cast<int>(std::ceil(side_m[a] / kPatch_m));
    const int rows = static_cast<int>(std::ceil(side_m[b] / kPatch_m));
    const double area_m2 = side_m[a] * side_m[b] / (columns * rows);
    const double radius_m = std::sqrt(area_m2 / std::numbers::pi);
    for (int patch = 0; patch < 2 * columns * rows; ++patch) {
      Reflector reflector;
      reflector.geom = geom;
      reflector.normal_S[axis] = patch % 2 == 0 ? 1.0f : -1.0f;
      const auto along = [](int i, double quarters, int n, double length_m) {
        return ((i + quarters / 4) / n - 0.5) * length_m;
      };
      for (const double u : {1.0, 3.0})
        for (const double v : {1.0, 3.0}) {
          Eigen::Vector3d p_S;
          p_S[axis] = reflector.normal_S[axis] * box.size_m[axis];
          p_S[a] = along(patch / 2 % columns, u, columns, side_m[a]);
          p_S[b] = along(patch / 2 / columns, v, rows, side_m[b]);
          reflector.samples_S.emplace_back(p_S.cast<float>());
        }
      reflector.per_irradiance_m2_sr =
          (area_m2 / std::numbers::pi * box.albedo.array()).cast<float>();
      reflector.halo = Halo(radius_m, /*disc=*/true);
      reflector.glow.radius_m = radius_m;
      reflectors_.push_back(std::move(reflector));
    }
  }
}

size_t Reflectors::Halo(double radius_m, bool disc) {
  const auto known = std::find_if(halos_.begin(), halos_.end(), [&](const KnownHalo& halo) {
    return halo.radius_m == radius_m && halo.disc == disc;
  });
  if (known != halos_.end()) return static_cast<size_t>(known - halos_.begin());
  const Glow unit{.radius_m = radius_m, .intensity_w_sr = Rgb::Ones(), .disc = disc};
  halos_.push_back({radius_m, disc, HaloTable(medium_, unit)});
  return halos_.size() - 1;
}

void Reflectors::Illuminate(const SurfaceTable& surfaces, std::span<const PlacedSurface> placed,
                            std::span<const Lamp> lamps, std::span<const int> casters,
                            PointBatch* batch) {
  const Eigen::Array3f loss_per_m = medium_.lighting_loss_per_m().cast<float>();
  for (Reflector& reflector : reflectors_) {
    const PlacedSurface& at = placed[static_cast<size_t>(reflector.geom)];
    int count = static_cast<int>(reflector.samples_S.size());
    reflector.p_HQ.setZero();
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3f p_HQ = at.p_HS + at.R_HS * reflector.samples_S[static_cast<size_t>(i)];
      SetPoint(p_HQ, at.R_HS * reflector.normal_S, i, batch);
      reflector.p_HQ += p_HQ / static_cast<float>(count);
    }
    if (count == 0) {  // a ball: where it is nearest to the head
      reflector.p_HQ = at.p_HS;
      const Eigen::Vector3f normal_H = -at.p_HS.normalized();
      const auto radius_m = static_cast<float>(reflector.glow.radius_m);
      SetPoint(at.p_HS + radius_m * normal_H, normal_H, count++, batch);
    }
    for (int i = count; i < PointBatch::kVector; ++i)
      SetPoint({batch->x_m[0], batch->y_m[0], batch->z_m[0]},
               {batch->normal_x[0], batch->normal_y[0], batch->normal_z[0]}, i, batch);
    batch->count = PointBatch::kVector;
    batch->Darken();
    for (const Lamp& lamp : lamps) {
      std::fill_n(batch->visible, PointBatch::kVector, 1.0f);
      for (const int geom : casters)
        if (geom != reflector.geom)
          CastShadow(surfaces[geom], placed[static_cast<size_t>(geom)], lamp.p_HE.cast<float>(),
                     batch);
      AddLampIrradiance(lamp, loss_per_m, batch);
    }
    const auto mean = [count](const float* channel) {
      float sum = 0;
      for (int i = 0; i < count; ++i) sum += channel[i];
      return sum / static_cast<float>(count);
    };
    const Eigen::Array3f irradiance_w_m2(mean(batch->red), mean(batch->green), mean(batch->blue));
    reflector.glow.intensity_w_sr =
        (reflector.per_irradiance_m2_sr * irradiance_w_m2).cast<double>();
  }
}

void Reflectors::AddHalos(const RayFrame& rays, int count, PointBatch* batch, Light* light) const {
  const Eigen::Array3f loss_per_m = medium_.halo_loss_per_m().cast<float>();
  for (const Reflector& reflector : reflectors_) {
    if (reflector.glow.intensity_w_sr.maxCoeff() <= 0) continue;
    AddHalo(rays, reflector.p_HQ,
            SeenFrom((reflector.p_HQ - rays.p_HC).norm(), medium_, reflector.glow), loss_per_m,
            halos_[reflector.halo].table, nullptr, count, batch, light);
  }
}

Rgb Reflectors::intensity_w_sr() const {
  Rgb sum = Rgb::Zero();
  for (const Reflector& reflector : reflectors_) sum += reflector.glow.intensity_w_sr;
  return sum;
}

}  // namespace turbidock::light
