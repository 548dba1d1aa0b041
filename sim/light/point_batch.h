#pragma once
// Light at many points at once: the terms of sim/light/water.h for a batch of pixels, in single
// precision, written as loops over the batch that the compiler vectorises. All points and
// directions are in the head frame H.

#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "sim/base/camera.h"
#include "sim/light/forward_peak.h"
#include "sim/light/scattering.h"
#include "sim/light/surfaces.h"

namespace turbidock::light {

struct PointBatch {
  static constexpr int kSize = 128;
  static constexpr int kVector = 16;  // points are computed in whole vectors
  using Values = float[kSize];

  int count = 0;
  alignas(64) Values u_px, v_px, depth_m;
  alignas(64) Values ray_x, ray_y, ray_z, range_m;  // unit vectors from the camera
  alignas(64) Values x_m, y_m, z_m;                 // where the rays end
  alignas(64) Values normal_x, normal_y, normal_z;  // of the surface there
  alignas(64) Values red, green, blue;              // radiance or irradiance
  alignas(64) Values visible;                       // 1 where the light at hand gets to, else 0
  // Of one ball's halo: where in its table the ray begins and ends, and where it enters and leaves
  // the box's shadow. Colours: the factor on what is found there.
  struct Places {
    alignas(64) int node[kSize];
    alignas(64) Values share;
    HaloTable::Place operator[](int i) const { return {node[i], share[i]}; }
  };
  Places offset, begin, end, dark_begin, dark_end;
  // How far along the ray the shadow begins and ends; equal without one.
  alignas(64) Values dark_begin_m, dark_end_m;
  // Of the ray's point nearest to the ball: how far along the ray, how far from the ball's centre
  // (at least the radius).
  alignas(64) Values foot_m, offset_m;

  void Darken() {
    for (float* channel : {red, green, blue}) std::fill_n(channel, count, 0.0f);
  }
};

// Rays of a camera's pixels.
struct RayFrame {
  Eigen::Vector3f p_HC = Eigen::Vector3f::Zero();
  Eigen::Vector3f corner_H, per_u_H, per_v_H;  // points at depth 1: corner + u per_u + v per_v

  explicit RayFrame(const MountedCamera& camera);
};

// A surface where it is now.
struct PlacedSurface {
  Eigen::Matrix3f R_HS = Eigen::Matrix3f::Identity();
  Eigen::Vector3f p_HS = Eigen::Vector3f::Zero();
};

// Rays, ranges and their ends from u, v and depth.
void FindRays(const RayFrame& frame, PointBatch* batch);
// Outward normals of points that lie on a surface.
void FindNormals(const Surface& surface, const PlacedSurface& placed, PointBatch* batch);

// Colours times a factor, and times exp(-c range).
void Scale(const Eigen::Array3f& factor, PointBatch* batch);
void Attenuate(const Eigen::Array3f& extinction_per_m, PointBatch* batch);

// The radiance of a lit ball: rim + core exp(-r^2 / (2 width^2)), r the distance of the ray from
// the ball's centre, without what the forward peak takes of it on the way. Added to the colours.
struct BallDisc {
  Eigen::Array3f rim_w_m2_sr, core_w_m2_sr;
  float core_width_m = 1, peak_per_m = 0;
};
void AddBallDisc(const BallDisc& disc, const RayFrame& frame, const Eigen::Vector3f& p_HBall,
                 PointBatch* batch);

// What the water spreads of a lit ball, as a camera sees it: radiance there is times the profile.
struct SpreadImage {
  SpreadBall::Profile profile{};
  Eigen::Array3f intensity_w_sr = Eigen::Array3f::Zero();  // less losses; 0: nothing to be seen
  float radius_m = 1, way_m = 1;                           // of water up to the ball
};
// Adds it to `light`, of the batch's first `count` rays. A ray that ends before the ball has the
// part that is scattered on that stretch, taken as even along the way. Uses the colours.
void AddSpread(const RayFrame& frame, const Eigen::Vector3f& p_HBall, const SpreadImage& spread,
               int count, PointBatch* batch, Light* light);

// A ball that holds all of a batch's points.
struct Bounds {
  Eigen::Vector3f p_H;
  float radius_m;
};
Bounds BoundsOf(const PointBatch& batch);
// Whether a solid can stand between some point within bounds and a light at p_HSource.
bool MayHide(const Surface& surface, const PlacedSurface& placed, const Eigen::Vector3f& p_HSource,
             const Bounds& lit);

// Dims `visible` to 0 where a solid stands between a point and a light at p_HSource.
void CastShadow(const Surface& surface, const PlacedSurface& placed,
                const Eigen::Vector3f& p_HSource, PointBatch* batch);

// E = I(alpha) cos(i) / d^2 exp(-G d), where visible. Added to the colours.
void AddLampIrradiance(const Lamp& lamp, const Eigen::Array3f& diffuse_per_m, PointBatch* batch);
// E = I cos(i) / d^2 exp(-G (d - R)), d to the ball's centre, where visible: exact for a Lambertian
// sphere all of which stands above the lit surface's horizon. Added to the colours.
void AddBallIrradiance(const Glow& glow, const Eigen::Array3f& diffuse_per_m,
                       const Eigen::Vector3f& p_HBall, PointBatch* batch);

// Adds a ball's halo to `light`, of the batch's first `count` rays: what its table (of unit
// intensity) has along them, but where the marker's box hides the ball (`shadow` may be null:
// nowhere). Leaves I / h exp(-G foot) as colours.
void AddHalo(const RayFrame& frame, const Eigen::Vector3f& p_HBall, const Glow& glow,
             const Eigen::Array3f& diffuse_per_m, const HaloTable& halo, const BoxShadow* shadow,
             int count, PointBatch* batch, Light* light);

}  // namespace turbidock::light
