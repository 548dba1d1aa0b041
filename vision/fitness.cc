#include "vision/fitness.h"

#include <algorithm>
#include <cmath>

namespace turbidock::vision {
namespace {

// F = ((2 inner - 36) - (2 outer - 24)) / 60.
double FitnessFromMatch(int match) { return (2 * match - (kInnerPoints - kOuterPoints)) / 60.0; }

}  // namespace

Fitness::Fitness(const MarkerParams& marker, const StereoRig& rig, const Image1u8& left_labels,
                 const Image1u8& right_labels)
    : samples_(marker),
      reach_(static_cast<float>(marker.outer_ring_ratio)),
      ball_count_(static_cast<int>(marker.balls.size())) {
  CheckFields(marker, "marker");
  for (int b = 0; b < ball_count_; ++b) {
    p_MQ_m_[b] = marker.balls[b].p_MQ_m;
    radius_m_[b] = marker.balls[b].radius_m;
  }
  const auto make_camera = [](const CameraIntrinsics& intrinsics, const Pose& X_HC,
                              const Image1u8& labels) {
    const Pose X_CH = X_HC.Inverse();
    return Camera{intrinsics, X_CH.R(), X_CH.p, &labels};
  };
  left_ = make_camera(rig.left, rig.X_HL, left_labels);
  right_ = make_camera(rig.right, rig.X_HR, right_labels);
}

int Fitness::Match(const Camera& camera, int ball, const Eigen::Vector3d& p_HQ) const {
  const Eigen::Vector3d p_CQ = camera.R_CH * p_HQ + camera.p_CH;
  if (!(p_CQ.z() >= kNearestDepth_m)) return 0;
  const BallCircle circle = ProjectBall(camera.intrinsics, p_CQ, radius_m_[ball]);

  const Image1u8& labels = *camera.labels;
  const int width = labels.width(), height = labels.height();
  const uint8_t* data = labels.data();
  // Half a pixel up, so that cutting the fraction off rounds to the nearest pixel.
  const float u = static_cast<float>(circle.u_px) + 0.5f,
              v = static_cast<float>(circle.v_px) + 0.5f;
  const float radius = static_cast<float>(circle.radius_px), extent = reach_ * radius + 1;
  if (!(u + extent >= 0 && v + extent >= 0 && u - extent < width && v - extent < height)) return 0;

  int inner = 0, outer = 0;
  if (u >= extent && v >= extent && u + extent < width && v + extent < height) {
    std::array<int, kBallPoints> at;
    for (int i = 0; i < kBallPoints; ++i)
      at[i] = static_cast<int>(v + radius * samples_.v[i]) * width +
              static_cast<int>(u + radius * samples_.u[i]);
    for (int i = 0; i < kInnerPoints; ++i) inner += (data[at[i]] >> ball) & 1;
    for (int i = kInnerPoints; i < kBallPoints; ++i) outer += (data[at[i]] >> ball) & 1;
    return inner - outer;
  }
  // Part of the circle is outside the image.
  for (int i = 0; i < kBallPoints; ++i) {
    const float x = u + radius * samples_.u[i], y = v + radius * samples_.v[i];
    if (!(x >= 0 && y >= 0 && x < width && y < height)) continue;
    const int match = (data[static_cast<int>(y) * width + static_cast<int>(x)] >> ball) & 1;
    (i < kInnerPoints ? inner : outer) += match;
  }
  return inner - outer;
}

double Fitness::Evaluate(const Pose& X_HM) const {
  const Eigen::Matrix3d R_HM = X_HM.R();
  int match = 0;
  for (int b = 0; b < ball_count_; ++b) {
    const Eigen::Vector3d p_HQ = R_HM * p_MQ_m_[b] + X_HM.p;
    match += Match(left_, b, p_HQ) + Match(right_, b, p_HQ);
  }
  // The mean of FitnessFromMatch over balls and cameras, with one division of integers.
  const int views = 2 * ball_count_;
  return (2 * match - (kInnerPoints - kOuterPoints) * views) /
         static_cast<double>(kBallPoints * views);
}

FitnessByBall Fitness::EvaluateByBall(const Pose& X_HM) const {
  const Eigen::Matrix3d R_HM = X_HM.R();
  FitnessByBall by_ball;
  for (int b = 0; b < ball_count_; ++b) {
    const Eigen::Vector3d p_HQ = R_HM * p_MQ_m_[b] + X_HM.p;
    by_ball.left[b] = FitnessFromMatch(Match(left_, b, p_HQ));
    by_ball.right[b] = FitnessFromMatch(Match(right_, b, p_HQ));
  }
  by_ball.fitness = Evaluate(X_HM);
  return by_ball;
}

}  // namespace turbidock::vision
