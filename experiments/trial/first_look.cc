#include "experiments/trial/first_look.h"

namespace turbidock::trial {

FirstLook::FirstLook(const vision::MarkerParams& marker, const vision::HueParams& hue,
                     const StereoRig& rig)
    : marker_(marker), rig_(rig), labeller_(hue, marker), fitness_(marker, rig, labels_) {}

StereoRegion FirstLook::RegionOf(const Pose& X_HM) const {
  return rig_.Each([&](const MountedCamera& camera) {
    const Pose X_CM = camera.X_HC.Inverse() * X_HM;
    Eigen::Array2d least(camera.width_px, camera.height_px), most(0, 0);
    for (const vision::BallParams& ball : marker_.balls) {
      const Eigen::Vector3d p_CQ = X_CM * ball.p_MQ_m;
      if (p_CQ.z() < vision::kNearestDepth_m) continue;
      const vision::BallCircle circle = vision::ProjectBall(camera, p_CQ, ball.radius_m);
      // the outer ring, and a pixel for rounding
      const double reach_px = marker_.outer_ring_ratio * circle.radius_px + 1;
      const Eigen::Array2d center_px(circle.u_px, circle.v_px);
      least = least.min(center_px - reach_px);
      most = most.max(center_px + reach_px + 1);
    }
    const Eigen::Array2d end(camera.width_px, camera.height_px);
    const Eigen::Array2i from = least.max(0).min(end).floor().cast<int>();
    const Eigen::Array2i to = most.max(0).min(end).ceil().cast<int>();
    const PixelRegion region = {from.x(), from.y(), to.x(), to.y()};
    return region.empty() ? PixelRegion{} : region;
  });
}

double FirstLook::Fitness(const StereoImage& images, const Pose& X_HM) {
  const StereoRegion region = RegionOf(X_HM);
  for (const Side side : kSides) labeller_.Label(images[side], region[side], &labels_[side]);
  fitness_.Confine(region);
  return fitness_.Evaluate(X_HM);
}

}  // namespace turbidock::trial
