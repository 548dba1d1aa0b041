#pragma once
// Where the vehicle's own parts stand in a lamp's light. They are fixed to the lamp and near it, so
// whether they hide it depends on the direction from the lamp alone: what the cameras see is beyond
// them all.

#include <Eigen/Core>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/pose.h"
#include "sim/light/optics_params.h"
#include "sim/light/surfaces.h"

namespace turbidock::light {

// Share of a lamp's lens that is seen from a direction, from a grid over the half space before it.
class OwnShadow {
 public:
  OwnShadow() = default;  // nothing stands in the light
  // Parts of the vehicle that stand before the lamp E (beam along x, pose in the head) and hide
  // something that the rig's cameras can see.
  OwnShadow(const std::vector<Surface>& parts, const Pose& X_HE, const StereoRig& rig);

  bool any() const { return !open_.empty(); }
  // Of a unit vector from the lamp, in the head.
  double OpenAt(const Eigen::Vector3d& e_H) const;

 private:
  Eigen::Matrix3d R_EH_ = Eigen::Matrix3d::Identity();
  std::vector<double> open_;
};

// A lamp of the scene, moved and turned as `params` have it. Outwards is the side of the head's
// middle on which it stands.
Pose PlaceLamp(const Pose& X_HE_of_scene, const LampParams& params);

// The vehicle's parts that can throw a shadow in a lamp's light: all that is drawn of it but the
// lamps' housings and arms (hull_lamp*) and what the lamp stands in by the scene. ConfigError when
// `X_HE` is inside another part, be it drawn or for contacts only.
std::vector<Surface> PartsBefore(const SurfaceTable& surfaces, const Pose& X_HE_of_scene,
                                 const Pose& X_HE);

}  // namespace turbidock::light
