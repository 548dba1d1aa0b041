#pragma once
// The water model: turns visibility (sim/rendered.h) into the linear radiance that reaches the
// cameras. Deferred shading: position, normal and albedo of a pixel are known, all light is
// computed here.
//
// Per pixel at range r, per channel, with a, b, c, G as in sim/scattering.h:
//   L = exp(-c r) (L_emitted + albedo / pi (E_lamps + E_balls)) + veil of the lamps + halos of the
//   balls.
// Light's way to a surface is attenuated with G, since scattering by small angles still lights a
// surface; its way to the camera with c, since it no longer makes an image (it makes veil and
// halo).
//
// The marker's shadow is cut out of the lamps' light on surfaces and (the box's only) out of the
// halos. Left out: shadows in the veil, blur of lit surfaces by forward scattering, light between
// surfaces.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/optics_params.h"
#include "sim/rendered.h"
#include "sim/scattering.h"
#include "sim/surfaces.h"

namespace turbidock::sim {

// Linear radiance per channel at both cameras, W m^-2 sr^-1.
struct RadianceStereo {
  int64_t tick = 0;
  Image3f left, right;
};

class Water {
 public:
  // X_HE: poses of the lamps in the head, beam along x. Checks the parameters, and that every lit
  // ball is a sphere named "ball_..." in the table (ConfigError).
  Water(const OpticsParams& params, const StereoRig& rig, const SurfaceTable& surfaces,
        const std::vector<Pose>& X_HE);

  // Allocates only when `out` does not have the size of the images.
  void Apply(const RenderedStereo& rendered, RadianceStereo* out);

  const Medium& medium() const { return medium_; }

 private:
  struct Eye {
    CameraIntrinsics camera;
    Pose X_HC;
    Eigen::Matrix3d R_HC;
    std::optional<VeilTable> veil;  // none with the lamps off or nothing that scatters
  };
  struct LitBall {
    int geom = -1;
    Glow glow;
    Rgb rim_w_m2_sr, core_w_m2_sr;
    std::optional<HaloTable> halo;
  };
  // A surface in the head frame at the current instant.
  struct Placed {
    Eigen::Matrix3d R_HS;
    Eigen::Vector3d p_HS;
  };
  struct Ray;

  void Place(const Pose& X_WH);
  void ShadeView(const Eye& eye, const RenderedView& view, Image3f* out) const;
  Ray RayOf(const Eye& eye, const RenderedView& view, int u, int v) const;
  Rgb SurfaceLight(const Ray& ray) const;
  Rgb WaterLight(const Eye& eye, const Ray& ray) const;

  Rgb Emitted(const Ray& ray) const;
  Rgb LampIrradiance(int geom, const Eigen::Vector3d& p_HQ, const Eigen::Vector3d& normal_H) const;
  Rgb BallIrradiance(int geom, const Eigen::Vector3d& p_HQ, const Eigen::Vector3d& normal_H) const;
  Rgb Halos(const Ray& ray) const;
  bool InShadow(const Eigen::Vector3d& p_HQ, const Eigen::Vector3d& p_HSource, int lit_geom,
                int source_geom) const;

  OpticsParams params_;
  SurfaceTable surfaces_;
  Medium medium_;
  Rgb extinction_per_m_, diffuse_per_m_;
  std::vector<Lamp> lamps_;  // empty when off
  std::vector<LitBall> lit_balls_;
  std::vector<int> casters_;
  std::array<Eye, 2> eyes_;
  std::vector<Placed> placed_;  // by geom id
};

}  // namespace turbidock::sim
