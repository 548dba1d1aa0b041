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

  // Axes y and z of the lamp, in the head: a direction's components along them are its place in the
  // grid.
  const Eigen::Vector3f& y_H() const { return y_H_; }
  const Eigen::Vector3f& z_H() const { return z_H_; }
  // Between four nodes: the lowest one's number, and the shares of the way from there to the next.
  struct Place {
    int node;
    float along_y, along_z;
  };
  [[gnu::always_inline]] static Place PlaceOf(float y, float z) {
    const float column = Node(y), row = Node(z);
    const int i = static_cast<int>(column), j = static_cast<int>(row);
    return {j * kNodes + i, column - static_cast<float>(i), row - static_cast<float>(j)};
  }
  // Share of the lens that is seen there, by a shadow's data; only where any() is true.
  [[gnu::always_inline]] static float OpenAt(const float* data, Place place) {
    const int n = place.node;
    const float low = data[n] + place.along_y * (data[n + 1] - data[n]);
    const float high = data[n + kNodes] + place.along_y * (data[n + kNodes + 1] - data[n + kNodes]);
    return low + place.along_z * (high - low);
  }
  const float* data() const { return open_.data(); }

 private:
  // The grid: orthographic, so that a step is 1.8 degrees about the axis. The published vehicle's
  // lens softens the edge of what stands 7 cm before it by more.
  static constexpr int kNodes = 65;
  // Within the grid, also for what is no number.
  [[gnu::always_inline]] static float Node(float component) {
    constexpr float kLast = kNodes - 1.001f;
    const float node = (component + 1) * (0.5f * (kNodes - 1));
    return node > 0 ? (node < kLast ? node : kLast) : 0;
  }

  Eigen::Vector3f y_H_ = Eigen::Vector3f::UnitY(), z_H_ = Eigen::Vector3f::UnitZ();
  std::vector<float> open_;
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
