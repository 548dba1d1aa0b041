#include "sim/water.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "sim/base/check.h"

namespace turbidock::sim {
namespace {

// Smaller tiles are computed pixel by pixel.
constexpr int kSmallestTile_px = 3;

// Shadows in a halo are followed as far as this behind the ball.
constexpr double kShadowReach_m = 2;

// Distance of a point from the segment AB.
double DistanceToSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  const double t = std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
  return (a + t * d - p).norm();
}

bool OneSurface(const Image1u16& surface, int u0, int v0, int u1, int v1) {
  const uint16_t first = *surface.at(u0, v0);
  for (int v = v0; v <= v1; ++v) {
    const uint16_t* row = surface.row(v);
    if (std::any_of(row + u0, row + u1 + 1, [first](uint16_t id) { return id != first; }))
      return false;
  }
  return true;
}

// Adds light(u, v) to the pixels [u0, u1] x [v0, v1]. Light is smooth where one surface is seen: it
// is bilinear between the corners if the middle agrees (a shadow, the edge of a beam, a ball's glow
// may be in the tile); if not, the tile's quarters are done.
template <class Light>
void AddTile(const Light& light, const ShadingParams& shading, const Image1u16& surface,
             int mixed_px, int u0, int v0, int u1, int v1, Image3f* out) {
  if (u1 - u0 + 1 < kSmallestTile_px || v1 - v0 + 1 < kSmallestTile_px) {
    for (int v = v0; v <= v1; ++v)
      for (int u = u0; u <= u1; ++u) {
        const Rgb value = light(u, v);
        for (int k = 0; k < 3; ++k) out->at(u, v)[k] += static_cast<float>(value[k]);
      }
    return;
  }
  const int um = (u0 + u1) / 2, vm = (v0 + v1) / 2;
  if (u1 - u0 < mixed_px || OneSurface(surface, u0, v0, u1, v1)) {
    const Rgb c00 = light(u0, v0), c10 = light(u1, v0), c01 = light(u0, v1), c11 = light(u1, v1);
    const Rgb middle = light(um, vm);
    const double x = static_cast<double>(um - u0) / (u1 - u0);
    const double y = static_cast<double>(vm - v0) / (v1 - v0);
    const Rgb expected = (1 - y) * ((1 - x) * c00 + x * c10) + y * ((1 - x) * c01 + x * c11);
    const Rgb allowed = shading.relative_tolerance * middle + shading.absolute_tolerance_w_m2_sr;
    if (((middle - expected).abs() <= allowed).all()) {
      if ((c00 + c10 + c01 + c11).maxCoeff() == 0) return;
      for (int v = v0; v <= v1; ++v) {
        const double t = static_cast<double>(v - v0) / (v1 - v0);
        const Eigen::Array3f first = (c00 + t * (c01 - c00)).cast<float>();
        const Eigen::Array3f last = (c10 + t * (c11 - c10)).cast<float>();
        const Eigen::Array3f slope = (last - first) / static_cast<float>(u1 - u0);
        float* pixel = out->at(u0, v);
        for (int i = 0; i <= u1 - u0; ++i, pixel += 3)
          for (int k = 0; k < 3; ++k)
            pixel[k] += std::max(0.0f, first[k] + static_cast<float>(i) * slope[k]);
      }
      return;
    }
  }
  AddTile(light, shading, surface, mixed_px, u0, v0, um, vm, out);
  AddTile(light, shading, surface, mixed_px, um + 1, v0, u1, vm, out);
  AddTile(light, shading, surface, mixed_px, u0, vm + 1, um, v1, out);
  AddTile(light, shading, surface, mixed_px, um + 1, vm + 1, u1, v1, out);
}

}  // namespace

// The ray of one pixel, in the head frame.
struct Water::Ray {
  int u, v;
  int geom;  // that it ends on; -1: none
  Eigen::Vector3d p_HC, u_H;
  double range_m;
};

Water::Water(const OpticsParams& params, const StereoRig& rig, const SurfaceTable& surfaces,
             const std::vector<Pose>& X_HE)
    : params_(params), surfaces_(surfaces) {
  CheckFields(params_, "optics");
  medium_ = MakeMedium(params_.water);
  extinction_per_m_ = medium_.extinction_per_m();
  diffuse_per_m_ = medium_.Diffuse(params_.water.multiple_scattering);
  const bool scatters = medium_.scattering_per_m.maxCoeff() > 0;

  if (params_.lamps.enabled)
    for (const Pose& X_HLamp : X_HE)
      lamps_.push_back({X_HLamp.p, X_HLamp.q * Eigen::Vector3d::UnitX(), params_.lamps});

  eyes_[0] = {rig.left, rig.X_HL, rig.X_HL.R(), {}};
  eyes_[1] = {rig.right, rig.X_HR, rig.X_HR.R(), {}};
  if (scatters && !lamps_.empty())
    for (Eye& eye : eyes_)
      eye.veil.emplace(medium_, diffuse_per_m_, lamps_, params_.water.port_m, eye.camera, eye.X_HC);

  const BallLightParams& lights = params_.ball_lights;
  if (lights.enabled)
    for (size_t i = 0; i < lights.balls.size(); ++i) {
      const BallLight& light = lights.balls[i];
      LitBall ball;
      ball.geom = surfaces_.Find("ball_" + light.name);
      if (ball.geom < 0 || surfaces_[ball.geom].shape != Shape::kSphere)
        throw ConfigError("ball_lights.balls[" + std::to_string(i) + "].name",
                          "the scene has no sphere ball_" + light.name);
      const Rgb color = light.current_factor * light.color.array();
      ball.rim_w_m2_sr = lights.rim_radiance_w_m2_sr * color;
      ball.core_w_m2_sr = lights.core_radiance_w_m2_sr * color;
      // I = Int L dA over the disc
      const double radius_m = surfaces_[ball.geom].size_m[0];
      const double two_var_m2 = 2 * lights.core_width_m * lights.core_width_m;
      ball.glow.radius_m = radius_m;
      ball.glow.intensity_w_sr =
          std::numbers::pi *
          (radius_m * radius_m * ball.rim_w_m2_sr +
           two_var_m2 * (1 - std::exp(-radius_m * radius_m / two_var_m2)) * ball.core_w_m2_sr);
      if (scatters) ball.halo.emplace(medium_, diffuse_per_m_, ball.glow);
      lit_balls_.push_back(std::move(ball));
    }

  for (int geom = 0; geom < surfaces_.size(); ++geom)
    if (surfaces_[geom].casts_shadow) casters_.push_back(geom);
  placed_.resize(surfaces_.size());
}

void Water::Apply(const RenderedStereo& rendered, RadianceStereo* out) {
  Place(rendered.X_WH);
  out->tick = rendered.tick;
  ShadeView(eyes_[0], rendered.left, &out->left);
  ShadeView(eyes_[1], rendered.right, &out->right);
}

void Water::Place(const Pose& X_WH) {
  const Pose X_HW = X_WH.Inverse();
  for (int geom = 0; geom < surfaces_.size(); ++geom) {
    const Surface& surface = surfaces_[geom];
    const Pose X_HS = surface.on_vehicle ? surface.X_AS : X_HW * surface.X_AS;
    placed_[geom] = {X_HS.R(), X_HS.p};
  }
}

void Water::ShadeView(const Eye& eye, const RenderedView& view, Image3f* out) const {
  const int width = eye.camera.width_px, height = eye.camera.height_px;
  TD_CHECK(view.surface.width() == width && view.surface.height() == height &&
               view.depth_m.width() == width && view.depth_m.height() == height,
           "the rendered view has another size than the rig's camera");
  out->Resize(width, height);
  std::fill(out->data(), out->data() + out->pixels() * 3, 0.0f);
  const auto add = [&](const auto& light, int tile_px, int mixed_px) {
    for (int v = 0; v < height; v += tile_px)
      for (int u = 0; u < width; u += tile_px)
        AddTile(light, params_.shading, view.surface, mixed_px, u, v,
                std::min(u + tile_px, width) - 1, std::min(v + tile_px, height) - 1, out);
  };
  const int tile_px = params_.shading.tile_px;
  add([&](int u, int v) { return SurfaceLight(RayOf(eye, view, u, v)); }, tile_px, 0);
  // apart, because it is smooth where surfaces are not: it depends on their distance only
  if (medium_.scattering_per_m.maxCoeff() > 0)
    add([&](int u, int v) { return WaterLight(eye, RayOf(eye, view, u, v)); },
        tile_px > 1 ? 2 * tile_px : 1, tile_px / 2);
}

Water::Ray Water::RayOf(const Eye& eye, const RenderedView& view, int u, int v) const {
  const int geom = *view.surface.at(u, v) - 1;
  const Eigen::Vector3d ray_C = eye.camera.RayAt(u, v);
  const double range_per_depth = ray_C.norm();
  return {.u = u,
          .v = v,
          .geom = geom,
          .p_HC = eye.X_HC.p,
          .u_H = eye.R_HC * (ray_C / range_per_depth),
          .range_m = geom < 0 ? std::numeric_limits<double>::infinity()
                              : range_per_depth * static_cast<double>(*view.depth_m.at(u, v))};
}

// What comes straight from the surface, attenuated after Beer and Lambert.
Rgb Water::SurfaceLight(const Ray& ray) const {
  if (ray.geom < 0) return Rgb::Zero();
  const Placed& placed = placed_[ray.geom];
  const Surface& surface = surfaces_[ray.geom];
  const Eigen::Vector3d p_HQ = ray.p_HC + ray.range_m * ray.u_H;
  const Eigen::Vector3d p_SQ = placed.R_HS.transpose() * (p_HQ - placed.p_HS);
  const Eigen::Vector3d normal_H = placed.R_HS * OutwardNormal(surface, p_SQ);
  const Rgb irradiance =
      LampIrradiance(ray.geom, p_HQ, normal_H) + BallIrradiance(ray.geom, p_HQ, normal_H);
  const Rgb leaving = Emitted(ray) + surface.albedo.array() / std::numbers::pi * irradiance;
  return leaving * (-extinction_per_m_ * ray.range_m).exp();
}

// What the water on the way scatters into the ray.
Rgb Water::WaterLight(const Eye& eye, const Ray& ray) const {
  Rgb light = Halos(ray);
  if (eye.veil) light += eye.veil->At(ray.u, ray.v, ray.range_m);
  return light;
}

// Radiance of a lit ball: rim and core.
Rgb Water::Emitted(const Ray& ray) const {
  for (const LitBall& ball : lit_balls_)
    if (ball.geom == ray.geom) {
      const Eigen::Vector3d p_CQ_H = placed_[ball.geom].p_HS - ray.p_HC;
      const double foot_m = p_CQ_H.dot(ray.u_H);
      const double offset2_m2 = p_CQ_H.squaredNorm() - foot_m * foot_m;
      const double width_m = params_.ball_lights.core_width_m;
      return ball.rim_w_m2_sr +
             ball.core_w_m2_sr * std::exp(-0.5 * offset2_m2 / (width_m * width_m));
    }
  return Rgb::Zero();
}

// E = sum I(alpha) cos(i) / d^2 exp(-G d).
Rgb Water::LampIrradiance(int geom, const Eigen::Vector3d& p_HQ,
                          const Eigen::Vector3d& normal_H) const {
  Rgb sum = Rgb::Zero();
  for (const Lamp& lamp : lamps_) {
    const Eigen::Vector3d p_EQ_H = p_HQ - lamp.p_HE;
    const double d_m = p_EQ_H.norm();
    const double cos_incidence = -normal_H.dot(p_EQ_H) / d_m;
    if (cos_incidence <= 0) continue;
    const double pattern = BeamPattern(lamp.beam, lamp.axis_H.dot(p_EQ_H) / d_m);
    if (pattern <= 0 || InShadow(p_HQ, lamp.p_HE, geom, -1)) continue;
    sum += lamp.beam.intensity_w_sr.array() * (-diffuse_per_m_ * d_m).exp() *
           (pattern * cos_incidence / (d_m * d_m));
  }
  return sum;
}

// E = sum I cos(i) / d^2 exp(-G (d - R)), d to the ball's centre: exact for a Lambertian sphere all
// of which stands above the lit surface's horizon.
Rgb Water::BallIrradiance(int geom, const Eigen::Vector3d& p_HQ,
                          const Eigen::Vector3d& normal_H) const {
  Rgb sum = Rgb::Zero();
  for (const LitBall& ball : lit_balls_) {
    if (ball.geom == geom) continue;
    const Eigen::Vector3d& p_HBall = placed_[ball.geom].p_HS;
    const Eigen::Vector3d p_QBall_H = p_HBall - p_HQ;
    const double d_m = std::max(p_QBall_H.norm(), ball.glow.radius_m);
    const double cos_incidence = normal_H.dot(p_QBall_H) / d_m;
    if (cos_incidence <= 0 || InShadow(p_HQ, p_HBall, geom, ball.geom)) continue;
    sum += ball.glow.intensity_w_sr * (-diffuse_per_m_ * (d_m - ball.glow.radius_m)).exp() *
           (cos_incidence / (d_m * d_m));
  }
  return sum;
}

Rgb Water::Halos(const Ray& ray) const {
  Rgb sum = Rgb::Zero();
  for (const LitBall& ball : lit_balls_) {
    if (!ball.halo) continue;
    const Eigen::Vector3d p_CQ_H = placed_[ball.geom].p_HS - ray.p_HC;
    const double foot_m = p_CQ_H.dot(ray.u_H);
    const double offset_m = std::sqrt(std::max(0.0, p_CQ_H.squaredNorm() - foot_m * foot_m));
    // not lit: what the marker's box hides from the ball
    Stretch dark;
    for (const int geom : casters_) {
      if (surfaces_[geom].shape != Shape::kBox) continue;
      const Placed& box = placed_[geom];
      const Eigen::Matrix3d R_SH = box.R_HS.transpose();
      dark = ShadowOnRay(surfaces_[geom], R_SH * (placed_[ball.geom].p_HS - box.p_HS),
                         R_SH * (ray.p_HC - box.p_HS), R_SH * ray.u_H,
                         {0, std::min(ray.range_m, foot_m + kShadowReach_m)});
      break;
    }
    sum += ball.halo->At(foot_m, offset_m, {0, ray.range_m}, dark);
  }
  return sum;
}

// Whether the marker stands between a lit point and the light. Convex surfaces do not shade
// themselves.
bool Water::InShadow(const Eigen::Vector3d& p_HQ, const Eigen::Vector3d& p_HSource, int lit_geom,
                     int source_geom) const {
  for (const int geom : casters_) {
    if (geom == lit_geom || geom == source_geom) continue;
    const Surface& surface = surfaces_[geom];
    const Placed& placed = placed_[geom];
    if (DistanceToSegment(placed.p_HS, p_HQ, p_HSource) > BoundingRadius(surface)) continue;
    if (SegmentHits(surface, placed.R_HS.transpose() * (p_HQ - placed.p_HS),
                    placed.R_HS.transpose() * (p_HSource - placed.p_HS)))
      return true;
  }
  return false;
}

}  // namespace turbidock::sim
