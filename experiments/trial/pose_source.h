#pragma once
// Where the autopilot's estimates come from: the cameras, or, to try controllers fast, the truth.

#include <cstdint>

#include "sim/base/camera.h"
#include "sim/base/fields.h"
#include "sim/base/pose_estimate.h"
#include "sim/base/random.h"
#include "vision/marker_model.h"

namespace turbidock::trial {

enum class PoseSource {
  kCameras,   // images, estimator
  kTruePose,  // the true pose with noise and the same delay; nothing need be drawn
};
constexpr auto Names(PoseSource) {
  using enum PoseSource;
  return EnumList<PoseSource>({{kCameras, "cameras"}, {kTruePose, "true_pose"}});
}

// What is put on the true pose in place of an estimator's errors. The numbers are measured on the
// estimator: see assets/measured/estimator.md.
struct TruePoseParams {
  Eigen::Vector4d noise{0.0004, 0.0001, 0.0001, 0.0013};
  double correlation_s = 0;
  double fitness = 0.8;
  double found_after_s = 0.5;

  static void Fields(auto& self, auto&& field) {
    field("noise", self.noise, InRange(0, 1),
          "standard deviation of the estimate, of x, y, z [m] and yaw [rad], at 0.6 m; that of x "
          "grows with the square of the distance, the others' in proportion");
    field("correlation_s", self.correlation_s, InRange(0, 10),
          "time in which the noise's correlation falls to 1/e; 0: independent in every frame");
    field("fitness", self.fitness, InRange(-1, 1), "of a ball in an image; -0.2 out of it");
    field("found_after_s", self.found_after_s, InRange(0, 60),
          "time that the search takes once the marker is in sight");
  }
};

// Stands in for an estimator in trials that are about control only.
class TruePose {
 public:
  TruePose(const TruePoseParams& params, const vision::MarkerParams& marker, const StereoRig& rig,
           double frame_s, Rng rng);

  // The estimate of a frame exposed when the marker was at X_HM. The fitness is a mean over balls
  // and images, as the estimator's.
  const PoseEstimate& Update(int64_t frame, const Pose& X_HM);

 private:
  double Fitness(const Pose& X_HM) const;

  TruePoseParams params_;
  vision::MarkerParams marker_;
  StereoRig rig_;
  double frame_s_;
  Rng rng_;
  Eigen::Vector4d noise_ = Eigen::Vector4d::Zero();  // unit variance
  bool started_ = false;
  int64_t frames_in_sight_ = 0;
  PoseEstimate estimate_;
};

}  // namespace turbidock::trial
