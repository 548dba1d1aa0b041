#include "sim/light/point_batch.h"

#include <algorithm>
#include <cmath>

#include "sim/base/vector_clones.h"
#include "sim/base/vector_math.h"

namespace turbidock::light {
namespace {

// Shadows in a halo are followed as far as this behind the ball.
constexpr float kShadowReach_m = 2;

// Shorter stretches of shadow are where a ray ends on the box.
constexpr float kTouch_m = 1e-4f;

struct Float3 {
  float x, y, z;
};

Float3 Of(const Eigen::Vector3f& a) { return {a.x(), a.y(), a.z()}; }
Float3 Of(const Eigen::Array3f& a) { return {a.x(), a.y(), a.z()}; }

// Rows of R_SH: components in S of a vector in H.
struct ToSurface {
  Float3 row[3];
  Float3 origin;
};

ToSurface Of(const PlacedSurface& placed) {
  return {{Of(Eigen::Vector3f(placed.R_HS.col(0))), Of(Eigen::Vector3f(placed.R_HS.col(1))),
           Of(Eigen::Vector3f(placed.R_HS.col(2)))},
          Of(placed.p_HS)};
}

[[gnu::always_inline]] inline float Dot(const Float3& a, float x, float y, float z) {
  return a.x * x + a.y * y + a.z * z;
}

TURBIDOCK_VECTOR_CLONES
void FindRaysLoop(Float3 origin, Float3 corner, Float3 per_u, Float3 per_v, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float u = b.u_px[i], v = b.v_px[i], depth = b.depth_m[i];
    const float dx = corner.x + u * per_u.x + v * per_v.x;
    const float dy = corner.y + u * per_u.y + v * per_v.y;
    const float dz = corner.z + u * per_u.z + v * per_v.z;
    const float length = std::sqrt(dx * dx + dy * dy + dz * dz);
    const float scale = 1.0f / length;
    b.ray_x[i] = dx * scale;
    b.ray_y[i] = dy * scale;
    b.ray_z[i] = dz * scale;
    b.range_m[i] = length * depth;
    b.x_m[i] = origin.x + depth * dx;
    b.y_m[i] = origin.y + depth * dy;
    b.z_m[i] = origin.z + depth * dz;
  }
}

TURBIDOCK_VECTOR_CLONES
void SphereNormals(Float3 center, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float x = b.x_m[i] - center.x, y = b.y_m[i] - center.y, z = b.z_m[i] - center.z;
    const float scale = 1.0f / std::sqrt(x * x + y * y + z * z);
    b.normal_x[i] = x * scale;
    b.normal_y[i] = y * scale;
    b.normal_z[i] = z * scale;
  }
}

// The face that the point is nearest to, or furthest outside.
TURBIDOCK_VECTOR_CLONES
void BoxNormals(ToSurface to, Float3 half, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float x = b.x_m[i] - to.origin.x, y = b.y_m[i] - to.origin.y, z = b.z_m[i] - to.origin.z;
    const float sx = Dot(to.row[0], x, y, z), sy = Dot(to.row[1], x, y, z),
                sz = Dot(to.row[2], x, y, z);
    const float ox = std::abs(sx) - half.x, oy = std::abs(sy) - half.y, oz = std::abs(sz) - half.z;
    const bool z_face = oz > ox && oz > oy;
    const bool y_face = oy > ox;  // unless it is z
    float nx = y_face ? to.row[1].x : to.row[0].x;
    float ny = y_face ? to.row[1].y : to.row[0].y;
    float nz = y_face ? to.row[1].z : to.row[0].z;
    float s = y_face ? sy : sx;
    nx = z_face ? to.row[2].x : nx;
    ny = z_face ? to.row[2].y : ny;
    nz = z_face ? to.row[2].z : nz;
    s = z_face ? sz : s;
    const float sign = s < 0.0f ? -1.0f : 1.0f;
    b.normal_x[i] = sign * nx;
    b.normal_y[i] = sign * ny;
    b.normal_z[i] = sign * nz;
  }
}

TURBIDOCK_VECTOR_CLONES
void ScaleLoop(Float3 factor, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    b.red[i] *= factor.x;
    b.green[i] *= factor.y;
    b.blue[i] *= factor.z;
  }
}

TURBIDOCK_VECTOR_CLONES
void AttenuateLoop(Float3 per_m, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float range = b.range_m[i];
    b.red[i] *= ExpMinus(per_m.x * range);
    b.green[i] *= ExpMinus(per_m.y * range);
    b.blue[i] *= ExpMinus(per_m.z * range);
  }
}

// The distance of the ray from the centre by the cross product: the difference of squares would
// cancel.
TURBIDOCK_VECTOR_CLONES
void BallDiscLoop(Float3 to_ball, Float3 rim, Float3 core, float per_two_var, float peak_per_m,
                  PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float x = to_ball.y * b.ray_z[i] - to_ball.z * b.ray_y[i];
    const float y = to_ball.z * b.ray_x[i] - to_ball.x * b.ray_z[i];
    const float z = to_ball.x * b.ray_y[i] - to_ball.y * b.ray_x[i];
    const float share = ExpMinus((x * x + y * y + z * z) * per_two_var);
    const float sharp = peak_per_m > 0.0f ? ExpMinus(peak_per_m * b.range_m[i]) : 1.0f;
    b.red[i] += sharp * (rim.x + core.x * share);
    b.green[i] += sharp * (rim.y + core.y * share);
    b.blue[i] += sharp * (rim.z + core.z * share);
  }
}

// A ball hides the source if it comes within a radius of the way there.
TURBIDOCK_VECTOR_CLONES
void SphereShadow(Float3 center, float radius_m, Float3 source, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float dx = source.x - b.x_m[i], dy = source.y - b.y_m[i], dz = source.z - b.z_m[i];
    const float cx = center.x - b.x_m[i], cy = center.y - b.y_m[i], cz = center.z - b.z_m[i];
    float t = (cx * dx + cy * dy + cz * dz) / (dx * dx + dy * dy + dz * dz);
    t = t > 0.0f ? t : 0.0f;
    t = t < 1.0f ? t : 1.0f;
    const float ex = t * dx - cx, ey = t * dy - cy, ez = t * dz - cz;
    b.visible[i] = ex * ex + ey * ey + ez * ez <= radius_m * radius_m ? 0.0f : b.visible[i];
  }
}

struct Span {
  float low, high;
};

// Where |a + t d| <= half.
[[gnu::always_inline]] inline Span InSlab(float a, float d, float half) {
  const float per_d = 1.0f / d, t0 = (-half - a) * per_d, t1 = (half - a) * per_d;
  return {t0 < t1 ? t0 : t1, t0 < t1 ? t1 : t0};
}

TURBIDOCK_VECTOR_CLONES
void BoxShadowLoop(ToSurface to, Float3 half, Float3 source, PointBatch& b) {
  // an exact zero would give 0 / 0 for a point in a face's plane
  constexpr float kTiny = 1e-20f;
  for (int i = 0; i < b.count; ++i) {
    const float x = b.x_m[i] - to.origin.x, y = b.y_m[i] - to.origin.y, z = b.z_m[i] - to.origin.z;
    const float ax = Dot(to.row[0], x, y, z), ay = Dot(to.row[1], x, y, z),
                az = Dot(to.row[2], x, y, z);
    const Span sx = InSlab(ax, source.x - ax + kTiny, half.x);
    const Span sy = InSlab(ay, source.y - ay + kTiny, half.y);
    const Span sz = InSlab(az, source.z - az + kTiny, half.z);
    float low = sx.low > sy.low ? sx.low : sy.low, high = sx.high < sy.high ? sx.high : sy.high;
    low = low > sz.low ? low : sz.low;
    low = low > 0.0f ? low : 0.0f;
    high = high < sz.high ? high : sz.high;
    high = high < 1.0f ? high : 1.0f;
    b.visible[i] = low <= high ? 0.0f : b.visible[i];
  }
}

// The beam's shape is in `visible`.
TURBIDOCK_VECTOR_CLONES
void LampLoop(Float3 lamp, Float3 intensity, Float3 diffuse, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float x = b.x_m[i] - lamp.x, y = b.y_m[i] - lamp.y, z = b.z_m[i] - lamp.z;
    const float d2 = x * x + y * y + z * z, d = std::sqrt(d2);
    const float facing = -(b.normal_x[i] * x + b.normal_y[i] * y + b.normal_z[i] * z);
    const float share = (facing > 0.0f ? facing : 0.0f) * b.visible[i] / (d2 * d);
    b.red[i] += intensity.x * share * ExpMinus(diffuse.x * d);
    b.green[i] += intensity.y * share * ExpMinus(diffuse.y * d);
    b.blue[i] += intensity.z * share * ExpMinus(diffuse.z * d);
  }
}

// A power of the cosine of the angle from a lamp's axis, where visible and in front of it; else 0.
TURBIDOCK_VECTOR_CLONES
void CosineBeamLoop(Float3 lamp, Float3 axis, float exponent, PointBatch& b) {
  constexpr float kLeast = 1e-6f;
  for (int i = 0; i < b.count; ++i) {
    const float x = b.x_m[i] - lamp.x, y = b.y_m[i] - lamp.y, z = b.z_m[i] - lamp.z;
    const float along = Dot(axis, x, y, z) / std::sqrt(x * x + y * y + z * z);
    const float pattern = Exp2(exponent * Log2(along > kLeast ? along : kLeast));
    b.visible[i] *= along > 0.0f ? pattern : 0.0f;
  }
}

TURBIDOCK_VECTOR_CLONES
void OwnShadowLoop(Float3 lamp, Float3 axis_y, Float3 axis_z, const float* __restrict open,
                   PointBatch& __restrict b) {
  for (int i = 0; i < b.count; ++i) {
    const float x = b.x_m[i] - lamp.x, y = b.y_m[i] - lamp.y, z = b.z_m[i] - lamp.z;
    const float scale = 1.0f / std::sqrt(x * x + y * y + z * z);
    b.visible[i] *= OwnShadow::OpenAt(
        open, OwnShadow::PlaceOf(scale * Dot(axis_y, x, y, z), scale * Dot(axis_z, x, y, z)));
  }
}

TURBIDOCK_VECTOR_CLONES
void BallLoop(Float3 ball, float radius_m, Float3 intensity, Float3 diffuse, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float x = ball.x - b.x_m[i], y = ball.y - b.y_m[i], z = ball.z - b.z_m[i];
    float d = std::sqrt(x * x + y * y + z * z);
    d = d > radius_m ? d : radius_m;
    const float facing = b.normal_x[i] * x + b.normal_y[i] * y + b.normal_z[i] * z;
    const float share = (facing > 0.0f ? facing : 0.0f) * b.visible[i] / (d * d * d);
    const float way = d - radius_m;
    b.red[i] += intensity.x * share * ExpMinus(diffuse.x * way);
    b.green[i] += intensity.y * share * ExpMinus(diffuse.y * way);
    b.blue[i] += intensity.z * share * ExpMinus(diffuse.z * way);
  }
}

// One of BoxShadow's bounds.
struct ShadowBound {
  float constant;
  Float3 gradient;
};

// s / (h + |s|), also where s is infinite.
[[gnu::always_inline]] inline float PlaceW(float s_m, float h_m) {
  const float w = s_m / (h_m + std::abs(s_m));
  return s_m < 1e9f ? w : 1.0f;
}

[[gnu::always_inline]] inline void Set(HaloTable::Place place, int i, PointBatch::Places& places) {
  places.node[i] = place.node;
  places.share[i] = place.share;
}

TURBIDOCK_VECTOR_CLONES
void PassBallLoop(Float3 to_ball, float radius_m, Float3 intensity, Float3 diffuse, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float rx = b.ray_x[i], ry = b.ray_y[i], rz = b.ray_z[i];
    const float foot = to_ball.x * rx + to_ball.y * ry + to_ball.z * rz;
    const float x = to_ball.x - foot * rx, y = to_ball.y - foot * ry, z = to_ball.z - foot * rz;
    const float offset = std::sqrt(x * x + y * y + z * z);
    const float h = offset > radius_m ? offset : radius_m, per_h = 1.0f / h;
    b.foot_m[i] = foot;
    b.offset_m[i] = h;
    Set(HaloTable::AtOffset(radius_m * per_h), i, b.offset);
    Set(HaloTable::At(PlaceW(-foot, h)), i, b.begin);
    Set(HaloTable::At(PlaceW(b.range_m[i] - foot, h)), i, b.end);
    b.red[i] = intensity.x * per_h * Exp2(-1.44269504f * (diffuse.x * foot));
    b.green[i] = intensity.y * per_h * Exp2(-1.44269504f * (diffuse.y * foot));
    b.blue[i] = intensity.z * per_h * Exp2(-1.44269504f * (diffuse.z * foot));
  }
}

// Colour red: how much of the way to the ball the ray sees, none behind the camera.
TURBIDOCK_VECTOR_CLONES
void SpreadPlacesLoop(Float3 to_ball, float radius_m, float per_way, PointBatch& b) {
  constexpr int kCells = SpreadBall::kPlaces - 1;
  for (int i = 0; i < b.count; ++i) {
    const float rx = b.ray_x[i], ry = b.ray_y[i], rz = b.ray_z[i];
    const float foot = to_ball.x * rx + to_ball.y * ry + to_ball.z * rz;
    const float x = to_ball.x - foot * rx, y = to_ball.y - foot * ry, z = to_ball.z - foot * rz;
    const float offset = std::sqrt(x * x + y * y + z * z);
    const float place = kCells * (offset / (offset + radius_m));
    int node = static_cast<int>(place);
    node = node < kCells - 1 ? node : kCells - 1;
    b.offset.node[i] = node;
    b.offset.share[i] = place - static_cast<float>(node);
    const float seen = b.range_m[i] * per_way;
    b.red[i] = foot > 0.0f ? (seen < 1.0f ? seen : 1.0f) : 0.0f;
  }
}

TURBIDOCK_VECTOR_CLONES
// NOLINTNEXTLINE(performance-unnecessary-value-param): stays in a register
void SpreadLoop(const float* profile, Light intensity, int count, const PointBatch& b,
                Light* light) {
  for (int i = 0; i < count; ++i) {
    const float* n = profile + b.offset.node[i];
    light[i] += intensity * (b.red[i] * (n[0] + b.offset.share[i] * (n[1] - n[0])));
  }
}

// Where a ball is hidden, in three steps: the stretch that may be, what each bound leaves of it,
// and the places of what is left.
TURBIDOCK_VECTOR_CLONES
void BeginShadowLoop(PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float range = b.range_m[i], reach = b.foot_m[i] + kShadowReach_m;
    b.dark_begin_m[i] = 0.0f;
    b.dark_end_m[i] = range < reach ? range : reach;
  }
}

TURBIDOCK_VECTOR_CLONES
void BoundShadowLoop(ShadowBound bound, PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float slope = Dot(bound.gradient, b.ray_x[i], b.ray_y[i], b.ray_z[i]);
    const float t = -bound.constant / slope;
    const float from = b.dark_begin_m[i], to = b.dark_end_m[i];
    b.dark_begin_m[i] = ((slope < 0.0f) & (t > from)) ? t : from;
    b.dark_end_m[i] = ((slope > 0.0f) & (t < to)) ? t : to;
  }
}

TURBIDOCK_VECTOR_CLONES
void EndShadowLoop(PointBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const float from = b.dark_begin_m[i], to = b.dark_end_m[i];
    const float foot = b.foot_m[i], h = b.offset_m[i];
    b.dark_end_m[i] = to - from > kTouch_m ? to : from;
    Set(HaloTable::At(PlaceW(from - foot, h)), i, b.dark_begin);
    Set(HaloTable::At(PlaceW(to - foot, h)), i, b.dark_end);
  }
}

TURBIDOCK_VECTOR_CLONES
void HaloLoop(const HaloTable& halo, bool shadow, int count, const PointBatch& b, Light* light) {
  for (int i = 0; i < count; ++i) {
    const auto up_to = [&](const PointBatch::Places& places) {
      return halo.Cumulative(b.offset[i], places[i]);
    };
    Light sum = up_to(b.end) - up_to(b.begin);
    if (shadow && b.dark_begin_m[i] != b.dark_end_m[i])
      sum -= up_to(b.dark_end) - up_to(b.dark_begin);
    light[i] += sum.max(0.0f) * Light(b.red[i], b.green[i], b.blue[i], 0);
  }
}

}  // namespace

RayFrame::RayFrame(const MountedCamera& camera) {
  const Eigen::Matrix3d R_HC = camera.X_HC.R();
  p_HC = camera.X_HC.p.cast<float>();
  corner_H = (R_HC * camera.RayAt(0, 0)).cast<float>();
  per_u_H = (R_HC.col(0) / camera.fx_px).cast<float>();
  per_v_H = (R_HC.col(1) / camera.fy_px).cast<float>();
}

void FindRays(const RayFrame& frame, PointBatch* batch) {
  FindRaysLoop(Of(frame.p_HC), Of(frame.corner_H), Of(frame.per_u_H), Of(frame.per_v_H), *batch);
}

void FindNormals(const Surface& surface, const PlacedSurface& placed, PointBatch* batch) {
  switch (surface.shape) {
    case Shape::kSphere:
      SphereNormals(Of(placed.p_HS), *batch);
      return;
    case Shape::kBox:
      BoxNormals(Of(placed), Of(Eigen::Vector3f(surface.size_m.cast<float>())), *batch);
      return;
    default:
      for (int i = 0; i < batch->count; ++i) {
        const Eigen::Vector3f p_HQ(batch->x_m[i], batch->y_m[i], batch->z_m[i]);
        const Eigen::Vector3d p_SQ =
            (placed.R_HS.transpose() * (p_HQ - placed.p_HS)).cast<double>();
        const Eigen::Vector3f normal_H = placed.R_HS * OutwardNormal(surface, p_SQ).cast<float>();
        batch->normal_x[i] = normal_H.x();
        batch->normal_y[i] = normal_H.y();
        batch->normal_z[i] = normal_H.z();
      }
  }
}

void Scale(const Eigen::Array3f& factor, PointBatch* batch) { ScaleLoop(Of(factor), *batch); }

void Attenuate(const Eigen::Array3f& extinction_per_m, PointBatch* batch) {
  AttenuateLoop(Of(extinction_per_m), *batch);
}

void AddBallDisc(const BallDisc& disc, const RayFrame& frame, const Eigen::Vector3f& p_HBall,
                 PointBatch* batch) {
  BallDiscLoop(Of(Eigen::Vector3f(p_HBall - frame.p_HC)), Of(disc.rim_w_m2_sr),
               Of(disc.core_w_m2_sr), 0.5f / (disc.core_width_m * disc.core_width_m),
               disc.peak_per_m, *batch);
}

void AddSpread(const RayFrame& frame, const Eigen::Vector3f& p_HBall, const SpreadImage& spread,
               int count, PointBatch* batch, Light* light) {
  SpreadPlacesLoop(Of(Eigen::Vector3f(p_HBall - frame.p_HC)), spread.radius_m, 1 / spread.way_m,
                   *batch);
  const Eigen::Array3f& rgb = spread.intensity_w_sr;
  SpreadLoop(spread.profile.data(), {rgb[0], rgb[1], rgb[2], 0}, count, *batch, light);
}

Bounds BoundsOf(const PointBatch& batch) {
  Eigen::Array3f low, high;
  int axis = 0;
  for (const float* values : {batch.x_m, batch.y_m, batch.z_m}) {
    const Eigen::Map<const Eigen::ArrayXf> all(values, batch.count);
    low[axis] = all.minCoeff();
    high[axis++] = all.maxCoeff();
  }
  return {(low + high) / 2, (high - low).matrix().norm() / 2};
}

bool MayHide(const Surface& surface, const PlacedSurface& placed, const Eigen::Vector3f& p_HSource,
             const Bounds& lit) {
  if (surface.shape == Shape::kPlane) return true;
  constexpr float kRounding_m = 1e-3f;
  // all ways to the points run within a cone that is this wide at most
  const auto reach_m = static_cast<float>(surface.size_m.sum()) + lit.radius_m + kRounding_m;
  const Eigen::Vector3f way = lit.p_H - p_HSource, to = placed.p_HS - p_HSource;
  const float t = std::clamp(to.dot(way) / way.squaredNorm(), 0.0f, 1.0f);
  return (t * way - to).squaredNorm() <= reach_m * reach_m;
}

void CastShadow(const Surface& surface, const PlacedSurface& placed,
                const Eigen::Vector3f& p_HSource, PointBatch* batch) {
  const Eigen::Vector3f p_SSource = placed.R_HS.transpose() * (p_HSource - placed.p_HS);
  switch (surface.shape) {
    case Shape::kSphere:
      SphereShadow(Of(placed.p_HS), static_cast<float>(surface.size_m[0]), Of(p_HSource), *batch);
      return;
    case Shape::kBox:
      BoxShadowLoop(Of(placed), Of(Eigen::Vector3f(surface.size_m.cast<float>())), Of(p_SSource),
                    *batch);
      return;
    default:
      for (int i = 0; i < batch->count; ++i) {
        const Eigen::Vector3f p_HQ(batch->x_m[i], batch->y_m[i], batch->z_m[i]);
        const Eigen::Vector3f p_SQ = placed.R_HS.transpose() * (p_HQ - placed.p_HS);
        if (SegmentHits(surface, p_SQ.cast<double>(), p_SSource.cast<double>()))
          batch->visible[i] = 0;
      }
  }
}

void AddLampIrradiance(const Lamp& lamp, const Eigen::Array3f& diffuse_per_m, PointBatch* batch) {
  const Eigen::Vector3f p_HE = lamp.p_HE.cast<float>();
  if (lamp.beam.beam == BeamShape::kCosine) {
    CosineBeamLoop(Of(p_HE), Of(Eigen::Vector3f(lamp.axis_H.cast<float>())),
                   static_cast<float>(lamp.beam.cosine_exponent), *batch);
  } else if (lamp.beam.beam == BeamShape::kCone) {
    for (int i = 0; i < batch->count; ++i) {
      const Eigen::Vector3d p_EQ_H =
          Eigen::Vector3d(batch->x_m[i], batch->y_m[i], batch->z_m[i]) - lamp.p_HE;
      batch->visible[i] *=
          static_cast<float>(BeamPattern(lamp.beam, lamp.axis_H.dot(p_EQ_H.normalized())));
    }
  }
  if (lamp.shadow.any())
    OwnShadowLoop(Of(p_HE), Of(lamp.shadow.y_H()), Of(lamp.shadow.z_H()), lamp.shadow.data(),
                  *batch);
  LampLoop(Of(p_HE), Of(Eigen::Vector3f(lamp.beam.intensity_w_sr.cast<float>())), Of(diffuse_per_m),
           *batch);
}

void AddBallIrradiance(const Glow& glow, const Eigen::Array3f& diffuse_per_m,
                       const Eigen::Vector3f& p_HBall, PointBatch* batch) {
  BallLoop(Of(p_HBall), static_cast<float>(glow.radius_m),
           Of(Eigen::Array3f(glow.intensity_w_sr.cast<float>())), Of(diffuse_per_m), *batch);
}

void AddHalo(const RayFrame& frame, const Eigen::Vector3f& p_HBall, const Glow& glow,
             const Eigen::Array3f& diffuse_per_m, const HaloTable& halo, const BoxShadow* shadow,
             int count, PointBatch* batch, Light* light) {
  PassBallLoop(Of(Eigen::Vector3f(p_HBall - frame.p_HC)), static_cast<float>(glow.radius_m),
               Of(Eigen::Array3f(glow.intensity_w_sr.cast<float>())), Of(diffuse_per_m), *batch);
  if (shadow == nullptr) return HaloLoop(halo, false, count, *batch, light);
  BeginShadowLoop(*batch);
  for (int k = 0; k < shadow->count; ++k) {
    const BoxShadow::Bound& bound = shadow->bounds[static_cast<size_t>(k)];
    BoundShadowLoop(
        {static_cast<float>(bound.constant), Of(Eigen::Vector3f(bound.gradient.cast<float>()))},
        *batch);
  }
  EndShadowLoop(*batch);
  HaloLoop(halo, true, count, *batch, light);
}

}  // namespace turbidock::light
