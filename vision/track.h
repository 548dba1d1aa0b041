#pragma once
// Where the next frame's search looks: everywhere, or about a marker that was found.

#include <array>
#include <optional>

#include "sim/base/camera.h"
#include "sim/base/fields.h"
#include "sim/base/image.h"
#include "sim/base/pose_estimate.h"
#include "vision/detection.h"
#include "vision/gene.h"
#include "vision/marker_model.h"
#include "vision/refiner.h"

namespace turbidock::vision {

// The search range about the track, half widths. They must hold the marker's motion from frame to
// frame beside what constant velocity predicts, and the error of the search.
struct TrackParams {
  bool enabled = true;
  int found_frames = 3;        // in a row before the range is narrowed
  double lateral_m = 0.03;     // y and z; 0.9 m/s at 30 Hz
  double depth_ratio = 0.08;   // x, over the distance
  double eps = 0.05;           // 6 degrees about one axis
  double velocity_gain = 0.3;  // share of a frame's motion that enters the predicted velocity

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Range{}, "narrow the search range about a found marker");
    field("found_frames", self.found_frames, InRange(1, 1000),
          "frames in a row that the marker must be found before");
    field("lateral_m", self.lateral_m, InRange(0.001, 10), "half width of the range in y and z");
    field("depth_ratio", self.depth_ratio, InRange(0.001, 1),
          "half width of the range in x, over the distance");
    field("eps", self.eps, InRange(0.001, 0.57), "half width of the range in eps1, eps2, eps3");
    field("velocity_gain", self.velocity_gain, InRange(0, 1),
          "share of a frame's motion that enters the predicted velocity; 0: no prediction");
  }
};

// Follows a marker that was found at nearly constant velocity.
class Track {
 public:
  // Lost, for that many uncertain frames in a row, the marker is looked for everywhere again.
  Track(const TrackParams& params, const SearchRange& everywhere, int lost_frames,
        const RefineParams& refine, const MarkerParams& marker, const StereoRig& rig);

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
  PixelRegion RegionOf(const CameraIntrinsics& camera, const Pose& X_HC) const;

  TrackParams params_;
  RefineParams refine_;
  MarkerParams marker_;
  StereoRig rig_;
  int lost_frames_;
  GeneMap everywhere_, range_;
  GeneMap::Values motion_{};
  GeneMap::Values velocity_{};                // per frame
  std::optional<GeneMap::Values> last_seen_;  // where the marker was detected in the last frame
  std::optional<StereoRegion> region_;
};

}  // namespace turbidock::vision
