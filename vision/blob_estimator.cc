#include "vision/blob_estimator.h"

#include <Eigen/Geometry>

namespace turbidock::vision {

std::optional<Eigen::Vector3d> Triangulate(const StereoRig& rig,
                                           const Stereo<Eigen::Vector2d>& pixels) {
  const auto ray_H = [&](Side side) -> Eigen::Vector3d {
    return (rig[side].X_HC.q * rig[side].RayAt(pixels[side].x(), pixels[side].y())).normalized();
  };
  const Eigen::Vector3d &p_HL = rig.left.X_HC.p, &p_HR = rig.right.X_HC.p;
  const Eigen::Vector3d a = ray_H(Side::kLeft), b = ray_H(Side::kRight), between = p_HR - p_HL;
  const double cosine = a.dot(b), sine2 = 1 - cosine * cosine;
  if (sine2 < 1e-12) return std::nullopt;
  const double s = (between.dot(a) - between.dot(b) * cosine) / sine2;
  const double t = (between.dot(a) * cosine - between.dot(b)) / sine2;
  if (s <= 0 || t <= 0) return std::nullopt;
  return 0.5 * (p_HL + s * a + p_HR + t * b);
}

BlobEstimator::BlobEstimator(const BlobParams& params, const MarkerParams& marker,
                             const HueParams& hue, const StereoRig& rig)
    : params_(params),
      marker_(marker),
      rig_(rig),
      labeller_(hue, marker),
      fitness_(marker, rig, labels_) {
  CheckFields(params, "blobs");
}

std::optional<Eigen::Vector2d> BlobEstimator::LargestBlob(const Image1u8& labels, int ball) {
  const int width = labels.width(), height = labels.height();
  visited_ = Image1u8(width, height, 0);
  int64_t most = params_.least_pixels - 1;
  std::optional<Eigen::Vector2d> centroid;
  const auto push = [&](int u, int v) {
    if (!labels.Contains(u, v) || !(*labels.at(u, v) >> ball & 1) || *visited_.at(u, v)) return;
    *visited_.at(u, v) = 1;
    stack_.push_back(v * width + u);
  };
  for (int v0 = 0; v0 < height; ++v0)
    for (int u0 = 0; u0 < width; ++u0) {
      push(u0, v0);
      int64_t count = 0;
      Eigen::Vector2d sum(0, 0);
      while (!stack_.empty()) {
        const int u = stack_.back() % width, v = stack_.back() / width;
        stack_.pop_back();
        ++count;
        sum += Eigen::Vector2d(u, v);
        push(u + 1, v);
        push(u - 1, v);
        push(u, v + 1);
        push(u, v - 1);
      }
      if (count <= most) continue;
      most = count;
      centroid = sum / static_cast<double>(count);
    }
  return centroid;
}

const PoseEstimate& BlobEstimator::Update(const StereoImage& seen) {
  for (const Side side : kSides) labeller_.Label(seen[side], &labels_[side]);
  Lap(timer(), LoopStage::kLabels);
  Eigen::Matrix3Xd p_MQ(3, 0), p_HQ(3, 0);
  for (size_t b = 0; b < marker_.balls.size(); ++b) {
    const auto left = LargestBlob(labels_.left, static_cast<int>(b));
    const auto right = LargestBlob(labels_.right, static_cast<int>(b));
    if (!left || !right) continue;
    const auto point = Triangulate(rig_, {*left, *right});
    if (!point) continue;
    p_MQ.conservativeResize(Eigen::NoChange, p_MQ.cols() + 1);
    p_HQ.conservativeResize(Eigen::NoChange, p_HQ.cols() + 1);
    p_MQ.rightCols<1>() = marker_.balls[b].p_MQ_m;
    p_HQ.rightCols<1>() = *point;
  }
  estimate_.frame = seen.frame;
  estimate_.evaluations = 0;
  estimate_.fitness = -1;
  estimate_.detected = false;
  estimate_.ball_fitness.assign(marker_.balls.size(), -1);
  if (p_MQ.cols() < 3) return estimate_;
  const Eigen::Matrix4d X = Eigen::umeyama(p_MQ, p_HQ, /*with_scaling=*/false);
  estimate_.X_HM = Pose{Eigen::Quaterniond(Eigen::Matrix3d(X.topLeftCorner<3, 3>())).normalized(),
                        X.topRightCorner<3, 1>()}
                       .Canonical();
  const FitnessByBall by_ball = fitness_.EvaluateByBall(estimate_.X_HM);
  estimate_.fitness = by_ball.fitness;
  for (size_t b = 0; b < marker_.balls.size(); ++b)
    estimate_.ball_fitness[b] = by_ball.ball(static_cast<int>(b));
  estimate_.detected = true;
  estimate_.evaluations = 1;
  return estimate_;
}

}  // namespace turbidock::vision
