#include "vision/track.h"

#include <algorithm>
#include <cmath>

#include "vision/refiner.h"

namespace turbidock::vision {
namespace {

constexpr int kFoundFrames = 3;  // certain in a row before the marker is followed
constexpr int kLostFrames = 5;   // uncertain in a row before it is looked for everywhere again

// Half widths of the range about the track. They hold what the marker moves from frame to frame
// beside what constant velocity predicts, and the error of the search.
constexpr double kLateral_m = 0.03;    // y and z; 0.9 m/s at 30 Hz
constexpr double kDepthRatio = 0.08;   // x, over the distance, as errors of depth are
constexpr double kEps = 0.05;          // 6 degrees about one axis
constexpr double kVelocityGain = 0.3;  // share of a frame's motion that enters the velocity

}  // namespace

Track::Track(const SearchRange& everywhere, const MarkerParams& marker, const StereoRig& rig)
    : marker_(marker), rig_(rig), everywhere_(everywhere), range_(everywhere) {}

void Track::Reset() {
  range_ = everywhere_;
  motion_ = velocity_ = {};
  last_seen_.reset();
  region_.reset();
}

bool Track::Update(const PoseEstimate& estimate, const Detection& detection) {
  const bool is_seen = detection.holds();
  const GeneMap::Values now = GeneMap::ValuesOf(estimate.X_HM);
  for (size_t i = 0; i < kGeneFields; ++i)
    velocity_[i] = is_seen && last_seen_
                       ? velocity_[i] + kVelocityGain * (now[i] - (*last_seen_)[i] - velocity_[i])
                       : 0;
  last_seen_ = is_seen ? std::optional(now) : std::nullopt;

  const bool was_following = region_.has_value();
  const bool follows = was_following ? is_seen && detection.frames_uncertain() < kLostFrames
                                     : detection.frames_certain() >= kFoundFrames;
  if (!follows) {
    range_ = everywhere_;
    motion_ = {};
    region_.reset();
    return was_following;
  }
  GeneMap::Values next, half_width;
  for (size_t i = 0; i < kGeneFields; ++i) {
    next[i] = now[i] + velocity_[i];
    half_width[i] = i == 0 ? kDepthRatio * now[0] : i < 3 ? kLateral_m : kEps;
  }
  range_ = everywhere_.Around(next, half_width);
  motion_ = velocity_;
  region_ = rig_.Each([this](const MountedCamera& camera) { return RegionOf(camera); });
  return true;
}

PixelRegion Track::RegionOf(const MountedCamera& camera) const {
  const GeneMap::Values &low = range_.low(), &high = range_.high();
  const Eigen::Vector3d low_m(low[0], low[1], low[2]), high_m(high[0], high[1], high[2]);
  GeneMap::Values middle;
  for (size_t i = 0; i < kGeneFields; ++i) middle[i] = 0.5 * (low[i] + high[i]);
  const Pose X_HM = GeneMap::PoseOf(middle);
  // The largest turn away from the middle: eps is half the rotation vector for small angles.
  const double turn_rad =
      2 * Eigen::Vector3d(high[3] - middle[3], high[4] - middle[4], high[5] - middle[5]).norm();
  const Pose X_CH = camera.X_HC.Inverse();
  Eigen::Vector2d least(camera.width_px, camera.height_px), most(-1, -1);
  for (const BallParams& ball : marker_.balls) {
    const double arm_m = turn_rad * ball.p_MQ_m.norm();
    const Eigen::Vector3d offset = X_HM.q * ball.p_MQ_m;
    for (int corner = 0; corner < 8; ++corner) {
      Eigen::Vector3d p_HQ;
      for (int k = 0; k < 3; ++k)
        p_HQ[k] = offset[k] + (corner >> k & 1 ? high_m[k] + arm_m : low_m[k] - arm_m);
      const Eigen::Vector3d p_CQ = X_CH * p_HQ;
      if (p_CQ.z() < kNearestDepth_m) return {0, 0, camera.width_px, camera.height_px};
      const BallCircle circle = ProjectBall(camera, p_CQ, ball.radius_m);
      // The envelope, and what refinement looks at beyond the outline.
      const double extent_px =
          std::max(marker_.outer_ring_ratio * circle.radius_px,
                   circle.radius_px + PoseRefiner::Reach_px(circle.radius_px)) +
          2;
      const Eigen::Vector2d center(circle.u_px, circle.v_px);
      least = least.cwiseMin(center - Eigen::Vector2d::Constant(extent_px));
      most = most.cwiseMax(center + Eigen::Vector2d::Constant(extent_px));
    }
  }
  const auto inside = [](double px, int size) {
    return static_cast<int>(std::clamp(px, 0.0, static_cast<double>(size)));
  };
  return {inside(std::floor(least.x()), camera.width_px),
          inside(std::floor(least.y()), camera.height_px),
          inside(std::ceil(most.x()) + 1, camera.width_px),
          inside(std::ceil(most.y()) + 1, camera.height_px)};
}

}  // namespace turbidock::vision
