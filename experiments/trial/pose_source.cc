#include "experiments/trial/pose_source.h"

#include <cmath>

#include "sim/base/published.h"

namespace turbidock::trial {
namespace {

constexpr double kNothing = -0.2;         // fitness of a ball that is not there: published rule
constexpr double kNoiseDistance_m = 0.6;  // where the noise is what the parameters say

}  // namespace

TruePose::TruePose(const TruePoseParams& params, const vision::MarkerParams& marker,
                   const StereoRig& rig, double frame_s, Rng rng)
    : params_(params), marker_(marker), rig_(rig), frame_s_(frame_s), rng_(rng) {
  CheckFields(params_, "");
}

const PoseEstimate& TruePose::Update(int64_t frame, const Pose& X_HM) {
  // A Gauss-Markov process for any correlation; always four draws, whatever is in sight.
  const double keep = params_.correlation_s > 0 ? std::exp(-frame_s_ / params_.correlation_s) : 0;
  for (double& noise : noise_)
    noise = started_ ? keep * noise + std::sqrt(1 - keep * keep) * rng_.Normal() : rng_.Normal();
  started_ = true;

  // Triangulation: bearings are equally good everywhere, depth is not.
  const double far = X_HM.p.x() / kNoiseDistance_m;
  const Eigen::Vector4d error =
      noise_.cwiseProduct(params_.noise).cwiseProduct(Eigen::Vector4d(far * far, far, far, far));
  const double fitness = Fitness(X_HM);
  frames_in_sight_ = fitness >= published::kDetectedFitness ? frames_in_sight_ + 1 : 0;
  const bool found = static_cast<double>(frames_in_sight_) * frame_s_ > params_.found_after_s;
  estimate_.frame = frame;
  estimate_.X_HM =
      Pose{FromYawPitchRoll(error[3], 0, 0) * X_HM.q, X_HM.p + error.head<3>()}.Canonical();
  estimate_.fitness = found ? fitness : kNothing;
  return estimate_;
}

double TruePose::Fitness(const Pose& X_HM) const {
  double sum = 0;
  for (const Side side : kSides) {
    const MountedCamera& camera = rig_[side];
    const Pose X_CM = camera.X_HC.Inverse() * X_HM;
    for (const vision::BallParams& ball : marker_.balls) {
      const Eigen::Vector3d p_CQ = X_CM * ball.p_MQ_m;
      bool seen = p_CQ.z() > vision::kNearestDepth_m;
      if (seen) {
        const vision::BallCircle circle = vision::ProjectBall(camera, p_CQ, ball.radius_m);
        seen = circle.u_px >= 0 && circle.u_px <= camera.width_px - 1 && circle.v_px >= 0 &&
               circle.v_px <= camera.height_px - 1;
      }
      sum += seen ? params_.fitness : kNothing;
    }
  }
  return sum / (2 * static_cast<double>(marker_.balls.size()));
}

}  // namespace turbidock::trial
