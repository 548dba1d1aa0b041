#pragma once
// Where the next frame's search looks: everywhere, or about a marker that was found.

#include <array>
#include <optional>

#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/base/pose_estimate.h"
#include "vision/detection.h"
#include "vision/gene.h"
#include "vision/marker_model.h"

namespace turbidock::vision {

// Follows a marker that was found at nearly constant velocity.
class Track {
 public:
  Track(const SearchRange& everywhere, const MarkerParams& marker, const StereoRig& rig);

  // Plans the next frame after this one; whether it searches another range than this one did.
  bool Update(const PoseEstimate& estimate, const Detection& detection);
  void Reset();

  // What to search next (x, y, z of the marker in H, m; eps1, eps2, eps3), ...
  const GeneMap& range() const { return range_; }
  // ... how far the marker moves until then, and ...
  const GeneMap::Values& motion() const { return motion_; }
  // ... while a marker is followed, the pixels in which it can be: the bounding rectangle, in each
  // image, of all projections of the range, what refinement looks at included.
  const std::optional<StereoRegion>& region() const { return region_; }

 private:
  PixelRegion RegionOf(const MountedCamera& camera) const;

  MarkerParams marker_;
  StereoRig rig_;
  GeneMap everywhere_, range_;
  GeneMap::Values motion_{};
  GeneMap::Values velocity_{};                // per frame
  std::optional<GeneMap::Values> last_seen_;  // where the marker was detected in the last frame
  std::optional<StereoRegion> region_;
};

}  // namespace turbidock::vision
