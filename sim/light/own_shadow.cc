#include "sim/light/own_shadow.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/base/check.h"
#include "sim/base/units.h"

namespace turbidock::light {
namespace {

constexpr double kFar_m = 10, kLensRadius_m = 0.017;

// Middle and rim of the lens, each for an equal part of its area.
std::array<Eigen::Vector3d, 7> LensPoints() {
  std::array<Eigen::Vector3d, 7> p_EL;
  p_EL[0].setZero();
  for (int i = 0; i < 6; ++i) {
    const double angle_rad = i * units::RadFromDeg(60);
    p_EL[static_cast<size_t>(i) + 1] =
        0.75 * kLensRadius_m * Eigen::Vector3d(0, std::cos(angle_rad), std::sin(angle_rad));
  }
  return p_EL;
}

bool Hides(const Surface& part, const Eigen::Vector3d& p_HA, const Eigen::Vector3d& p_HB) {
  const Pose X_SH = part.X_AS.Inverse();
  return SegmentHits(part, X_SH * p_HA, X_SH * p_HB);
}

// Whether the part keeps the lamp's light from something that the cameras see.
bool IsInTheWay(const Surface& part, const Pose& X_HE, const StereoRig& rig) {
  constexpr int kSteps = 6;
  if ((X_HE.Inverse() * part.X_AS.p).x() < -part.size_m.norm()) return false;
  for (const MountedCamera* camera : {&rig.left, &rig.right})
    for (int row = 0; row <= kSteps; ++row)
      for (int column = 0; column <= kSteps; ++column) {
        const int u = column * (camera->width_px - 1) / kSteps;
        const int v = row * (camera->height_px - 1) / kSteps;
        const Eigen::Vector3d ray_C = camera->RayAt(u, v);
        double depth_m = 0.05;
        while (depth_m < kFar_m) {
          if (Hides(part, X_HE.p, camera->X_HC * (depth_m * ray_C).eval())) return true;
          depth_m *= 1.5;
        }
      }
  return false;
}

}  // namespace

OwnShadow::OwnShadow(const std::vector<Surface>& parts, const Pose& X_HE, const StereoRig& rig)
    : y_H_(X_HE.R().col(1).cast<float>()), z_H_(X_HE.R().col(2).cast<float>()) {
  std::vector<Surface> before;
  for (const Surface& part : parts)
    if (IsInTheWay(part, X_HE, rig)) before.push_back(part);
  if (before.empty()) return;
  open_.reserve(kNodes * kNodes);
  for (int row = 0; row < kNodes; ++row)
    for (int column = 0; column < kNodes; ++column) {
      const double y = 2.0 * column / (kNodes - 1) - 1, z = 2.0 * row / (kNodes - 1) - 1;
      const Eigen::Vector3d e_E(std::sqrt(std::max(0.0, 1 - y * y - z * z)), y, z);
      int seen = 0;
      for (const Eigen::Vector3d& p_EL : LensPoints())
        seen += std::none_of(before.begin(), before.end(), [&](const Surface& part) {
          return Hides(part, X_HE * p_EL, X_HE * (p_EL + kFar_m * e_E).eval());
        });
      open_.push_back(static_cast<float>(seen) / static_cast<float>(LensPoints().size()));
    }
}

double OwnShadow::OpenAt(const Eigen::Vector3d& e_H) const {
  if (open_.empty()) return 1;
  const Eigen::Vector3f e = e_H.cast<float>();
  return OpenAt(data(), PlaceOf(y_H_.dot(e), z_H_.dot(e)));
}

Pose PlaceLamp(const Pose& X_HE_of_scene, const LampParams& params) {
  const double outwards = X_HE_of_scene.p.y() < 0 ? -1 : 1;
  const Eigen::Vector3d shift_m = params.shift_m.cwiseProduct(Eigen::Vector3d(1, outwards, 1));
  const Eigen::Quaterniond turn =
      FromYawPitchRoll(-outwards * params.toe_in_rad, -params.tilt_rad, 0);
  return {turn * X_HE_of_scene.q, X_HE_of_scene.p + shift_m};
}

std::vector<Surface> PartsBefore(const SurfaceTable& surfaces, const Pose& X_HE_of_scene,
                                 const Pose& X_HE) {
  std::vector<Surface> parts;
  for (int geom = 0; geom < surfaces.size(); ++geom) {
    const Surface& part = surfaces[geom];
    if (part.fixed_to != FixedTo::kVehicle || Hides(part, X_HE_of_scene.p, X_HE_of_scene.p))
      continue;
    if (Hides(part, X_HE.p, X_HE.p))
      throw ConfigError("lights.lamps.shift_m", "puts a lamp into the vehicle's " + part.name);
    if (part.shades_lamps) parts.push_back(part);
  }
  return parts;
}

}  // namespace turbidock::light
