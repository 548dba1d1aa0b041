#include "sim/light/surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::light {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Part of a line a + t d, empty when low > high.
struct Interval {
  double low = -kInfinity, high = kInfinity;

  bool Meets(double from, double to) const { return std::max(low, from) <= std::min(high, to); }
};

Interval Intersection(const Interval& a, const Interval& b) {
  return {std::max(a.low, b.low), std::min(a.high, b.high)};
}

// Where |x| <= half.
Interval InSlab(double a, double d, double half) {
  if (d == 0) return std::abs(a) <= half ? Interval{} : Interval{1, 0};
  const double t0 = (-half - a) / d, t1 = (half - a) / d;
  return {std::min(t0, t1), std::max(t0, t1)};
}

// Where qa t^2 + 2 qb t + qc <= 0, with qa >= 0.
Interval BelowZero(double qa, double qb, double qc) {
  if (qa == 0) return qc <= 0 ? Interval{} : Interval{1, 0};
  const double discriminant = qb * qb - qa * qc;
  if (discriminant < 0) return {1, 0};
  const double root = std::sqrt(discriminant);
  return {(-qb - root) / qa, (-qb + root) / qa};
}

Interval InUnitBall(const Eigen::Vector3d& a, const Eigen::Vector3d& d) {
  return BelowZero(d.squaredNorm(), a.dot(d), a.squaredNorm() - 1);
}

Interval InTube(const Eigen::Vector3d& a, const Eigen::Vector3d& d, double radius) {
  const auto a2 = a.head<2>(), d2 = d.head<2>();
  return BelowZero(d2.squaredNorm(), a2.dot(d2), a2.squaredNorm() - radius * radius);
}

Shape ShapeOf(int mujoco_type, const std::string& name) {
  switch (mujoco_type) {
    case mjGEOM_PLANE:
      return Shape::kPlane;
    case mjGEOM_SPHERE:
      return Shape::kSphere;
    case mjGEOM_CAPSULE:
      return Shape::kCapsule;
    case mjGEOM_ELLIPSOID:
      return Shape::kEllipsoid;
    case mjGEOM_CYLINDER:
      return Shape::kCylinder;
    case mjGEOM_BOX:
    case mjGEOM_MESH:  // lit as the box around it: enough for the thin plates that are drawn as
                       // meshes
      return Shape::kBox;
    default:
      throw ConfigError("geom " + name,
                        "its shape cannot be lit: use plane, sphere, capsule, ellipsoid, cylinder, "
                        "or box");
  }
}

Pose GeomPose(const mjData& data, int geom) {
  mjtNum quat[4];
  mju_mat2Quat(quat, data.geom_xmat + 9 * geom);
  return {Eigen::Quaterniond(quat[0], quat[1], quat[2], quat[3]),
          Eigen::Vector3d(data.geom_xpos + 3 * geom)};
}

// Positions of everything as the MJCF has it.
vehicle::MjDataPtr AtRest(const vehicle::Scene& scene) {
  vehicle::MjDataPtr data(mj_makeData(scene.model.get()));
  mj_kinematics(scene.model.get(), data.get());
  return data;
}

}  // namespace

Eigen::Vector3d OutwardNormal(const Surface& surface, const Eigen::Vector3d& p_SQ) {
  const Eigen::Vector3d& size = surface.size_m;
  const double side = p_SQ.z() < 0 ? -1 : 1;
  switch (surface.shape) {
    case Shape::kPlane:
      return Eigen::Vector3d::UnitZ();
    case Shape::kSphere:
      return p_SQ.normalized();
    case Shape::kEllipsoid:
      return (p_SQ.array() / size.array().square()).matrix().normalized();
    case Shape::kCapsule: {
      const Eigen::Vector3d axis_point(0, 0, std::clamp(p_SQ.z(), -size[1], size[1]));
      return (p_SQ - axis_point).normalized();
    }
    case Shape::kCylinder: {
      const double from_side = p_SQ.head<2>().norm() - size[0];
      if (std::abs(p_SQ.z()) - size[1] > from_side) return {0, 0, side};
      return Eigen::Vector3d(p_SQ.x(), p_SQ.y(), 0).normalized();
    }
    case Shape::kBox:
      break;
  }
  Eigen::Index axis;
  (p_SQ.array().abs() - size.array()).maxCoeff(&axis);
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  normal[axis] = p_SQ[axis] < 0 ? -1 : 1;
  return normal;
}

bool SegmentHits(const Surface& surface, const Eigen::Vector3d& p_SA, const Eigen::Vector3d& p_SB) {
  const Eigen::Vector3d d = p_SB - p_SA;
  const Eigen::Vector3d& size = surface.size_m;
  switch (surface.shape) {
    case Shape::kPlane:
      return (p_SA.z() > 0) != (p_SB.z() > 0);
    case Shape::kSphere:
      return InUnitBall(p_SA / size[0], d / size[0]).Meets(0, 1);
    case Shape::kEllipsoid:
      return InUnitBall((p_SA.array() / size.array()).matrix(), (d.array() / size.array()).matrix())
          .Meets(0, 1);
    case Shape::kCylinder:
      return Intersection(InTube(p_SA, d, size[0]), InSlab(p_SA.z(), d.z(), size[1])).Meets(0, 1);
    case Shape::kCapsule: {
      const Eigen::Vector3d end(0, 0, size[1]);
      return Intersection(InTube(p_SA, d, size[0]), InSlab(p_SA.z(), d.z(), size[1])).Meets(0, 1) ||
             InUnitBall((p_SA - end) / size[0], d / size[0]).Meets(0, 1) ||
             InUnitBall((p_SA + end) / size[0], d / size[0]).Meets(0, 1);
    }
    case Shape::kBox:
      break;
  }
  Interval inside;
  for (int i = 0; i < 3; ++i) inside = Intersection(inside, InSlab(p_SA[i], d[i], size[i]));
  return inside.Meets(0, 1);
}

// A point of the way from C to P = A + t u is C + (P - C) / x with x >= 1. It is on the box's side
// of a face with outward normal n, h from the centre, when
//   x (n.C - h) + n.(A - C) + t n.u <= 0,
// linear in x and t. A face that C is beyond (n.C > h) limits x from above, the others and x >= 1
// from below; some x is left when each lower limit is below each upper one.
BoxShadow::BoxShadow(const Surface& box, const Eigen::Matrix3d& R_ES, const Eigen::Vector3d& p_SC,
                     const Eigen::Vector3d& p_SA) {
  TD_CHECK(box.shape == Shape::kBox, box.name);
  struct Face {
    double a, b;  // of x a + b + t n.u <= 0
    Eigen::Vector3d n;
  };
  std::array<Face, 6> faces;
  for (int i = 0; i < 3; ++i)
    for (const int k : {0, 1}) {
      const double side = k == 0 ? -1 : 1;
      faces[2 * i + k] = {side * p_SC[i] - box.size_m[i], side * (p_SA - p_SC)[i],
                          side * R_ES.col(i)};
    }
  const auto add = [&](double constant, const Eigen::Vector3d& gradient) {
    bounds[static_cast<size_t>(count++)] = {constant, gradient};
  };
  for (const Face& upper : faces) {
    if (upper.a <= 0) continue;
    add(upper.a + upper.b, upper.n);
    for (const Face& lower : faces)
      if (lower.a <= 0)
        add(upper.a * lower.b - lower.a * upper.b, upper.a * lower.n - lower.a * upper.n);
  }
}

SurfaceTable::SurfaceTable(std::vector<Surface> surfaces) : surfaces_(std::move(surfaces)) {
  for (const Surface& surface : surfaces_)
    TD_CHECK(surface.X_AS.IsFinite() && surface.size_m.allFinite() && surface.albedo.allFinite(),
             surface.name);
}

SurfaceTable SurfaceTable::FromScene(const vehicle::Scene& scene,
                                     const std::vector<view::Distractor>& distractors) {
  const mjModel& model = *scene.model;
  const vehicle::MjDataPtr data = AtRest(scene);
  const Pose X_HW = vehicle::SitePose(*data, scene.camera_head_site).Inverse();
  const Pose X_KW = scene.moored_body.body >= 0
                        ? vehicle::BodyPose(*data, scene.moored_body.body).Inverse()
                        : Pose();
  std::vector<Surface> surfaces(model.ngeom);
  for (int geom = 0; geom < model.ngeom; ++geom) {
    Surface& surface = surfaces[geom];
    const char* name = mj_id2name(&model, mjOBJ_GEOM, geom);
    surface.name = name ? name : "number " + std::to_string(geom);
    surface.shape = ShapeOf(model.geom_type[geom], surface.name);
    surface.size_m = Eigen::Vector3d(model.geom_size + 3 * geom);
    const int root = model.body_rootid[model.geom_bodyid[geom]];
    const Pose X_WS = GeomPose(*data, geom);
    surface.X_AS = X_WS;
    if (root == model.body_rootid[scene.vehicle_body]) {
      surface.fixed_to = FixedTo::kVehicle;
      surface.X_AS = X_HW * X_WS;
      surface.shades_lamps = model.geom_group[geom] != vehicle::kContactsOnlyGroup &&
                             !surface.name.starts_with("hull_lamp");
    } else if (root == scene.moored_body.body) {
      surface.fixed_to = FixedTo::kMooredBody;
      surface.X_AS = X_KW * X_WS;
    }
    surface.albedo = Eigen::Vector3f(model.geom_rgba + 4 * geom).cast<double>();
    surface.casts_shadow = scene.geom_part[geom] == vehicle::Part::kMarker;
  }
  for (const view::Distractor& distractor : distractors)
    surfaces.push_back({.name = distractor.name,
                        .shape = distractor.ball ? Shape::kSphere : Shape::kBox,
                        .size_m = distractor.half_size_m,
                        .fixed_to = FixedTo::kWorld,
                        .X_AS = distractor.X_WV,
                        .albedo = distractor.albedo,
                        .casts_shadow = false,
                        .shines_as = distractor.shines_as});
  return SurfaceTable(std::move(surfaces));
}

int SurfaceTable::Find(const std::string& name) const {
  for (int geom = 0; geom < size(); ++geom)
    if (surfaces_[geom].name == name) return geom;
  return -1;
}

std::vector<Pose> LampPoses(const vehicle::Scene& scene) {
  const vehicle::MjDataPtr data = AtRest(scene);
  const Pose X_HW = vehicle::SitePose(*data, scene.camera_head_site).Inverse();
  std::vector<Pose> X_HE;
  for (const int site : scene.lamp_sites) X_HE.push_back(X_HW * vehicle::SitePose(*data, site));
  return X_HE;
}

}  // namespace turbidock::light
