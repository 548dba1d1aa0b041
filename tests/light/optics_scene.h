#pragma once
// Scenes for the optics tests, made without MuJoCo or OpenGL: surfaces given by hand, seen by a ray
// caster of the tests' own.

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "sim/base/camera.h"
#include "sim/light/surfaces.h"
#include "sim/view/rendered.h"

namespace turbidock::testing {

using light::Shape;
using light::Surface;
using view::RenderedStereo;
using view::RenderedView;

inline light::Surface Ball(std::string name, const Pose& X_WS, double radius_m,
                           const Eigen::Vector3d& albedo) {
  return {.name = std::move(name),
          .shape = light::Shape::kSphere,
          .size_m = {radius_m, 0, 0},
          .fixed_to = light::FixedTo::kWorld,
          .X_AS = X_WS,
          .albedo = albedo,
          .casts_shadow = true};
}

inline light::Surface Block(std::string name, const Pose& X_WS, const Eigen::Vector3d& half_m,
                            double albedo, bool casts_shadow) {
  return {.name = std::move(name),
          .shape = light::Shape::kBox,
          .size_m = half_m,
          .fixed_to = light::FixedTo::kWorld,
          .X_AS = X_WS,
          .albedo = Eigen::Vector3d::Constant(albedo),
          .casts_shadow = casts_shadow};
}

// The default marker in front of the station's plate, with the albedos of the path-traced images.
inline std::vector<light::Surface> MarkerAndPlate(const Pose& X_WM) {
  const auto at = [&](double x_m, double y_m, double z_m) {
    return X_WM * Pose::Translation(x_m, y_m, z_m);
  };
  return {Block("marker_box", at(0, 0, 0), {0.05, 0.05, 0.05}, 0.5, true),
          Ball("ball_green", at(-0.07, 0, 0), 0.02, 0.75 * Eigen::Vector3d(0.03, 1, 0.08)),
          Ball("ball_red", at(0, 0, 0.07), 0.02, 0.75 * Eigen::Vector3d(1, 0.03, 0.03)),
          Ball("ball_blue", at(0, -0.07, 0), 0.02, 0.75 * Eigen::Vector3d(0.03, 0.10, 1)),
          Block("station_plate", at(0.12, 0, 0), {0.01, 0.3, 0.225}, 0.2, false)};
}

// Distance along the unit ray (a, u) in S to a sphere, box or plane; infinite if it misses.
inline double RayDistance(const light::Surface& surface, const Eigen::Vector3d& a,
                          const Eigen::Vector3d& u) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  if (surface.shape == light::Shape::kPlane) {
    const double t = -a.z() / u.z();
    return t > 0 ? t : kMiss;
  }
  if (surface.shape == light::Shape::kSphere) {
    const double foot = -a.dot(u), offset2 = (a + foot * u).squaredNorm();
    const double half2 = surface.size_m[0] * surface.size_m[0] - offset2;
    return half2 < 0 || foot < 0 ? kMiss : foot - std::sqrt(half2);
  }
  // box: the nearest face that the ray crosses inside its rectangle
  double nearest = kMiss;
  for (int i = 0; i < 3; ++i)
    for (const double side : {-1.0, 1.0}) {
      const double t = (side * surface.size_m[i] - a[i]) / u[i];
      if (!(t > 0) || t >= nearest) continue;
      const Eigen::Vector3d p = a + t * u;
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      if (std::abs(p[j]) <= surface.size_m[j] && std::abs(p[k]) <= surface.size_m[k]) nearest = t;
    }
  return nearest;
}

inline view::RenderedView CastView(const std::vector<light::Surface>& surfaces,
                                   const CameraIntrinsics& camera, const Pose& X_HC,
                                   const Pose& X_WH) {
  constexpr float kNothing = std::numeric_limits<float>::infinity();
  view::RenderedView view;
  view.surface.Resize(camera.width_px, camera.height_px, 0);
  view.depth_m.Resize(camera.width_px, camera.height_px, kNothing);
  std::vector<Pose> X_SC;
  for (const light::Surface& s : surfaces)
    X_SC.push_back(s.X_AS.Inverse() *
                   (s.fixed_to == light::FixedTo::kVehicle ? X_HC : X_WH * X_HC));
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector3d ray_C = camera.RayAt(u, v);
      double nearest = std::numeric_limits<double>::infinity();
      for (size_t i = 0; i < surfaces.size(); ++i) {
        const double t = RayDistance(surfaces[i], X_SC[i].p, X_SC[i].q * ray_C.normalized());
        if (t >= nearest) continue;
        nearest = t;
        *view.surface.at(u, v) = static_cast<uint16_t>(i + 1);
        *view.depth_m.at(u, v) = static_cast<float>(t / ray_C.norm());
      }
    }
  return view;
}

inline view::RenderedStereo Cast(const std::vector<light::Surface>& surfaces, const StereoRig& rig,
                                 const Pose& X_WH = {}) {
  return {rig.Each([&](const MountedCamera& camera) {
            return CastView(surfaces, camera, camera.X_HC, X_WH);
          }),
          X_WH, Pose()};
}

// Two lamps beside the cameras, as on the published vehicle.
inline std::vector<Pose> LampsAt(double offset_m) {
  return {Pose::Translation(0, offset_m, 0), Pose::Translation(0, -offset_m, 0)};
}

// The default rig at a quarter of its resolution, for tests that need few pixels.
inline StereoRig SmallRig() {
  RigParams rig;
  rig.width_px = 160;
  rig.height_px = 120;
  return rig.MakeRig();
}

}  // namespace turbidock::testing
