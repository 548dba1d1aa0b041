#pragma once
// The water model of sim/light/water.h written plainly: every pixel by itself, in double precision,
// with the integrals summed instead of looked up. The oracle for the fast one.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "sim/light/scattering.h"
#include "sim/light/surfaces.h"
#include "tests/light/optics_scene.h"

namespace turbidock::testing {

class PlainWater {
 public:
  PlainWater(const light::OpticsParams& params, const StereoRig& rig,
             const std::vector<light::Surface>& surfaces, const std::vector<Pose>& X_HE)
      : params_(params),
        rig_(rig),
        surfaces_(surfaces),
        medium_(light::MakeMedium(params.water)),
        extinction_per_m_(medium_.extinction_per_m()),
        lighting_loss_per_m_(medium_.lighting_loss_per_m()),
        halo_loss_per_m_(medium_.halo_loss_per_m()) {
    if (params.lamps.enabled)
      for (const Pose& X : X_HE)
        lamps_.push_back({X.p, X.q * Eigen::Vector3d::UnitX(), params.lamps});
    if (!params.ball_lights.enabled) return;
    const auto& lights = params.ball_lights;
    for (const light::BallLight& light : lights.balls)
      for (size_t geom = 0; geom < surfaces.size(); ++geom)
        if (surfaces[geom].name == "ball_" + light.name) {
          const light::Rgb color = light.current_factor * light.color.array();
          const double R = surfaces[geom].size_m[0], w2 = 2 * std::pow(lights.core_width_m, 2);
          balls_.push_back(
              {static_cast<int>(geom),
               lights.rim_radiance_w_m2_sr * color,
               lights.core_radiance_w_m2_sr * color,
               {R, std::numbers::pi * color *
                       (R * R * lights.rim_radiance_w_m2_sr +
                        w2 * (1 - std::exp(-R * R / w2)) * lights.core_radiance_w_m2_sr)}});
        }
  }

  // Radiance at a pixel of the left camera.
  light::Rgb At(const view::RenderedStereo& rendered, int u, int v) const {
    const int geom = *rendered.left.surface.at(u, v) - 1;
    const Eigen::Vector3d ray_C = rig_.left.RayAt(u, v);
    const double range_m = geom < 0 ? std::numeric_limits<double>::infinity()
                                    : ray_C.norm() * double{*rendered.left.depth_m.at(u, v)};
    const Eigen::Vector3d p_HC = rig_.left.X_HC.p, u_H = rig_.left.X_HC.q * ray_C.normalized();
    const Pose X_HW = rendered.X_WH.Inverse();
    std::vector<Pose> X_HS;
    for (const light::Surface& s : surfaces_)
      X_HS.push_back(s.fixed_to == light::FixedTo::kVehicle ? s.X_AS : X_HW * s.X_AS);

    light::Rgb sum = light::Rgb::Zero();
    if (geom >= 0) sum = FromSurface(X_HS, geom, p_HC, u_H, range_m);
    if (medium_.scattering_per_m.maxCoeff() == 0) return sum;
    for (const light::Lamp& lamp : lamps_)
      sum += light::VeilAlongRay(medium_, lighting_loss_per_m_, lamp, p_HC, u_H,
                                 {params_.water.port_m, range_m}, 200);
    for (const Ball& ball : balls_) sum += Halo(X_HS, ball, p_HC, u_H, range_m);
    return sum;
  }

 private:
  struct Ball {
    int geom;
    light::Rgb rim, core;
    light::Glow glow;
  };

  light::Rgb FromSurface(const std::vector<Pose>& X_HS, int geom, const Eigen::Vector3d& p_HC,
                         const Eigen::Vector3d& u_H, double range_m) const {
    const Eigen::Vector3d p_HQ = p_HC + range_m * u_H;
    const Eigen::Vector3d normal_H =
        X_HS[geom].q * light::OutwardNormal(surfaces_[geom], X_HS[geom].Inverse() * p_HQ);
    light::Rgb irradiance = light::Rgb::Zero(), emitted = light::Rgb::Zero();
    for (const light::Lamp& lamp : lamps_) {
      const Eigen::Vector3d d = p_HQ - lamp.p_HE;
      const double cosine = -normal_H.dot(d.normalized());
      if (cosine > 0 && !Hidden(X_HS, p_HQ, lamp.p_HE, geom, -1))
        irradiance += lamp.beam.intensity_w_sr.array() * (-lighting_loss_per_m_ * d.norm()).exp() *
                      (light::BeamPattern(lamp.beam, lamp.axis_H.dot(d.normalized())) * cosine /
                       d.squaredNorm());
    }
    for (const Ball& ball : balls_) {
      const Eigen::Vector3d p_HBall = X_HS[ball.geom].p, d = p_HBall - p_HQ;
      if (ball.geom == geom) {
        const double offset_m = (p_HBall - p_HC).cross(u_H).norm();
        emitted =
            ball.rim +
            ball.core * std::exp(-0.5 * std::pow(offset_m / params_.ball_lights.core_width_m, 2));
        continue;
      }
      const double d_m = std::max(d.norm(), ball.glow.radius_m), cosine = normal_H.dot(d) / d_m;
      if (cosine > 0 && !Hidden(X_HS, p_HQ, p_HBall, geom, ball.geom))
        irradiance += ball.glow.intensity_w_sr *
                      (-lighting_loss_per_m_ * (d_m - ball.glow.radius_m)).exp() *
                      (cosine / d_m / d_m);
    }
    return (emitted + surfaces_[geom].albedo.array() / std::numbers::pi * irradiance) *
           (-extinction_per_m_ * range_m).exp();
  }

  // The halo along the lit parts of the ray: the box's shadow is found by asking at many points.
  light::Rgb Halo(const std::vector<Pose>& X_HS, const Ball& ball, const Eigen::Vector3d& p_HC,
                  const Eigen::Vector3d& u_H, double range_m) const {
    constexpr int kSteps = 400;
    const Eigen::Vector3d p_HBall = X_HS[ball.geom].p;
    const double foot_m = u_H.dot(p_HBall - p_HC), offset_m = (p_HBall - p_HC).cross(u_H).norm();
    const auto lit = [&](double t0_m, double t1_m, int samples) {
      const light::Glow seen = light::SeenFrom((p_HBall - p_HC).norm(), medium_, ball.glow);
      return light::HaloAlongRay(medium_, halo_loss_per_m_, seen, foot_m, offset_m, {t0_m, t1_m},
                                 samples);
    };
    int box = -1;
    for (size_t i = 0; i < surfaces_.size(); ++i)
      if (surfaces_[i].casts_shadow && surfaces_[i].shape == light::Shape::kBox)
        box = static_cast<int>(i);
    light::Rgb sum = lit(0, range_m, 400);
    const double end_m = std::min(range_m, foot_m + 2);
    if (box < 0 || !(end_m > 0)) return sum;
    for (int k = 0; k < kSteps; ++k) {
      const double t0_m = end_m * k / kSteps, t1_m = end_m * (k + 1) / kSteps;
      const Pose X_SH = X_HS[box].Inverse();
      if (light::SegmentHits(surfaces_[box], X_SH * (p_HC + 0.5 * (t0_m + t1_m) * u_H),
                             X_SH * p_HBall))
        sum -= lit(t0_m, t1_m, 2);
    }
    return sum.max(0.0);
  }

  bool Hidden(const std::vector<Pose>& X_HS, const Eigen::Vector3d& p_HQ,
              const Eigen::Vector3d& p_HSource, int lit_geom, int source_geom) const {
    for (int i = 0; i < static_cast<int>(surfaces_.size()); ++i) {
      if (!surfaces_[i].casts_shadow || i == lit_geom || i == source_geom) continue;
      const Pose X_SH = X_HS[i].Inverse();
      if (light::SegmentHits(surfaces_[i], X_SH * p_HQ, X_SH * p_HSource)) return true;
    }
    return false;
  }

  light::OpticsParams params_;
  StereoRig rig_;
  std::vector<light::Surface> surfaces_;
  light::Medium medium_;
  light::Rgb extinction_per_m_, lighting_loss_per_m_, halo_loss_per_m_;
  std::vector<light::Lamp> lamps_;
  std::vector<Ball> balls_;
};

}  // namespace turbidock::testing
