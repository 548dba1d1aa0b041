#pragma once
// What each pixel shows: shape, place and colour of the scene's geoms, so that position, normal and
// albedo follow from a geom id and a depth. S is a surface's own frame (MuJoCo's geom frame).

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "sim/base/pose.h"
#include "sim/vehicle/scene.h"
#include "sim/view/distractors.h"

namespace turbidock::light {

// What a surface goes with, and A, the frame that it stands still in.
enum class FixedTo {
  kWorld,       // A = W
  kVehicle,     // A = H
  kMooredBody,  // A = K: marker and station, where they can move (vehicle::MooredBody)
};

enum class Shape { kPlane, kSphere, kCapsule, kEllipsoid, kCylinder, kBox };

struct Surface {
  std::string name;
  Shape shape = Shape::kBox;
  // MuJoCo's geom_size: sphere (radius, -, -); capsule and cylinder (radius, half length along z,
  // -); ellipsoid semi-axes; box half sides. A plane is z = 0, faces +z and is taken as endless.
  Eigen::Vector3d size_m = Eigen::Vector3d::Constant(0.5);
  FixedTo fixed_to = FixedTo::kWorld;
  Pose X_AS;
  Eigen::Vector3d albedo = Eigen::Vector3d::Constant(0.5);  // linear, diffuse
  bool casts_shadow = false;
  bool shades_lamps = false;  // of the vehicle, in the light of its own lamps
  std::string shines_as{};    // a distractor: the ball whose light it has; empty: none
};

// Unit normal, pointing outwards, at a point on (or within rounding of) the surface.
Eigen::Vector3d OutwardNormal(const Surface& surface, const Eigen::Vector3d& p_SQ);

// Whether the straight line from A to B meets the solid.
bool SegmentHits(const Surface& surface, const Eigen::Vector3d& p_SA, const Eigen::Vector3d& p_SB);

// Part of a ray A + t u; empty unless t1 > t0.
struct Stretch {
  double t0_m = 0, t1_m = 0;
};

// Where rays from a point A pass through the shadow that a box casts in the light of a point source
// C: A + t u with t >= 0 is hidden from C when constant + t gradient . u <= 0 for all bounds. (All
// in one frame.) It is one piece, since the shadow of a convex body is convex.
struct BoxShadow {
  struct Bound {
    double constant = 0;
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  };
  // Of three faces that C is beyond: with each of the others, and the ray's own side of the box.
  std::array<Bound, 12> bounds;
  int count = 0;

  BoxShadow(const Surface& box, const Eigen::Matrix3d& R_ES, const Eigen::Vector3d& p_SC,
            const Eigen::Vector3d& p_SA);
};

// The surfaces by geom id.
class SurfaceTable {
 public:
  explicit SurfaceTable(std::vector<Surface> surfaces);

  // All geoms of a scene; the marker's cast shadows. Albedo is the geom's rgba (not its
  // material's). Throws ConfigError for a geom of another shape (mesh, height field). After them
  // distractors, whose place is each picture's.
  static SurfaceTable FromScene(const vehicle::Scene& scene,
                                const std::vector<view::Distractor>& distractors = {});

  int size() const { return static_cast<int>(surfaces_.size()); }
  const Surface& operator[](int geom) const { return surfaces_[geom]; }
  int Find(const std::string& name) const;  // geom id, -1 if there is none

 private:
  std::vector<Surface> surfaces_;
};

// Poses in H of the lamps (beam along x), from the scene's sites.
std::vector<Pose> LampPoses(const vehicle::Scene& scene);

}  // namespace turbidock::light
