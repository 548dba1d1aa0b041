#include "vision/fitness.h"

#include <algorithm>

#include "sim/base/vector_clones.h"

namespace turbidock::vision {
namespace {

// F = ((2 inner - 36) - (2 outer - 24)) / 60.
double FitnessFromMatch(int match) { return (2 * match - (kInnerPoints - kOuterPoints)) / 60.0; }

// Poses that are evaluated together: their circles stay in the nearest cache.
constexpr int kBatchPoses = 32;

// Circles of one ball in one camera, each wholly inside the region that is read.
struct CircleBatch {
  int count = 0;
  std::array<float, kBatchPoses> u, v, radius;
  std::array<int, kBatchPoses> pose;

  void Add(float u_px, float v_px, float radius_px, int pose_index) {
    const auto i = static_cast<size_t>(count++);
    u[i] = u_px, v[i] = v_px, radius[i] = radius_px, pose[i] = pose_index;
  }
};

// Adds inner minus outer matches of the circles to match[pose]. `bit` of a label counts.
TURBIDOCK_VECTOR_CLONES
void AddMatches(const float* sample_u, const float* sample_v, const uint8_t* labels, int width,
                int bit, const CircleBatch& batch, int* match) {
  const int mask = 1 << bit;
  for (int c = 0; c < batch.count; ++c) {
    const float u = batch.u[c], v = batch.v[c], radius = batch.radius[c];
    alignas(64) std::array<int, kBallPoints> at;
    for (int i = 0; i < kBallPoints; ++i)
      at[i] = static_cast<int>(v + radius * sample_v[i]) * width +
              static_cast<int>(u + radius * sample_u[i]);
    int inner = 0, outer = 0;
#pragma GCC unroll 12
    for (int i = 0; i < kInnerPoints; ++i) inner += labels[at[i]] & mask;
#pragma GCC unroll 12
    for (int i = kInnerPoints; i < kBallPoints; ++i) outer += labels[at[i]] & mask;
    match[batch.pose[c]] += (inner - outer) >> bit;
  }
}

}  // namespace

Fitness::Fitness(const MarkerParams& marker, const StereoRig& rig, const Stereo<Image1u8>& labels)
    : samples_(marker),
      reach_(static_cast<float>(marker.outer_ring_ratio)),
      ball_count_(static_cast<int>(marker.balls.size())) {
  CheckFields(marker, "marker");
  for (int b = 0; b < ball_count_; ++b) {
    p_MQ_m_[b] = marker.balls[b].p_MQ_m;
    radius_m_[b] = marker.balls[b].radius_m;
  }
  for (const Side side : kSides) {
    const Pose X_CH = rig[side].X_HC.Inverse();
    cameras_[side] = {rig[side], X_CH.R(), X_CH.p, &labels[side], WholeImages(rig)[side]};
  }
}

void Fitness::Confine(const StereoRegion& region) {
  for (const Side side : kSides) {
    const PixelRegion& part = region[side];
    Camera& camera = cameras_[side];
    TD_CHECK(part.column_begin >= 0 && part.row_begin >= 0 &&
                 part.column_end <= camera.intrinsics.width_px &&
                 part.row_end <= camera.intrinsics.height_px,
             "the region reaches over the image");
    camera.region = part;
  }
}

Fitness::Place Fitness::Project(const Camera& camera, int ball, const Eigen::Vector3d& p_HQ,
                                Circle* circle) const {
  const Eigen::Vector3d p_CQ = camera.R_CH * p_HQ + camera.p_CH;
  if (!(p_CQ.z() >= kNearestDepth_m)) return Place::kOutside;
  const BallCircle projected = ProjectBall(camera.intrinsics, p_CQ, radius_m_[ball]);
  const float u = static_cast<float>(projected.u_px) + 0.5f,
              v = static_cast<float>(projected.v_px) + 0.5f;
  const float radius = static_cast<float>(projected.radius_px), extent = reach_ * radius + 1;
  *circle = {u, v, radius};
  const PixelRegion& part = camera.region;
  const auto left = static_cast<float>(part.column_begin), top = static_cast<float>(part.row_begin),
             right = static_cast<float>(part.column_end), bottom = static_cast<float>(part.row_end);
  if (u - extent >= left && v - extent >= top && u + extent < right && v + extent < bottom)
    return Place::kInside;
  if (u + extent >= left && v + extent >= top && u - extent < right && v - extent < bottom)
    return Place::kPartly;
  return Place::kOutside;  // or not a number
}

int Fitness::MatchPointByPoint(const Camera& camera, int ball, const Circle& circle) const {
  const PixelRegion& part = camera.region;
  int inner = 0, outer = 0;
  for (int i = 0; i < kBallPoints; ++i) {
    const float x = circle.u + circle.radius * samples_.u[i],
                y = circle.v + circle.radius * samples_.v[i];
    if (!(x >= static_cast<float>(part.column_begin) && y >= static_cast<float>(part.row_begin) &&
          x < static_cast<float>(part.column_end) && y < static_cast<float>(part.row_end)))
      continue;
    const int match = (*camera.labels->at(static_cast<int>(x), static_cast<int>(y)) >> ball) & 1;
    (i < kInnerPoints ? inner : outer) += match;
  }
  return inner - outer;
}

int Fitness::Match(const Camera& camera, int ball, const Eigen::Vector3d& p_HQ) const {
  Circle circle;
  if (Project(camera, ball, p_HQ, &circle) == Place::kOutside) return 0;
  return MatchPointByPoint(camera, ball, circle);
}

// The mean of FitnessFromMatch over balls and cameras, with one division of integers.
double Fitness::FitnessOfMatches(int match) const {
  const int views = 2 * ball_count_;
  return (2 * match - (kInnerPoints - kOuterPoints) * views) /
         static_cast<double>(kBallPoints * views);
}

double Fitness::Evaluate(const Pose& X_HM) const {
  const Eigen::Matrix3d R_HM = X_HM.R();
  int match = 0;
  for (int b = 0; b < ball_count_; ++b) {
    const Eigen::Vector3d p_HQ = R_HM * p_MQ_m_[b] + X_HM.p;
    match += Match(cameras_.left, b, p_HQ) + Match(cameras_.right, b, p_HQ);
  }
  return FitnessOfMatches(match);
}

void Fitness::EvaluateAll(std::span<const Pose> X_HM, std::span<double> fitness) const {
  TD_CHECK(X_HM.size() == fitness.size(), "one F a pose");
  CircleBatch batch;
  for (size_t begin = 0; begin < X_HM.size(); begin += kBatchPoses) {
    const size_t poses = std::min(X_HM.size() - begin, size_t{kBatchPoses});
    std::array<Eigen::Matrix3d, kBatchPoses> R_HM;
    for (size_t i = 0; i < poses; ++i) R_HM[i] = X_HM[begin + i].R();
    std::array<int, kBatchPoses> match{};
    for (int b = 0; b < ball_count_; ++b)
      for (const Side side : kSides) {
        const Camera& camera = cameras_[side];
        batch.count = 0;
        for (size_t i = 0; i < poses; ++i) {
          const Eigen::Vector3d p_HQ = R_HM[i] * p_MQ_m_[b] + X_HM[begin + i].p;
          Circle circle;
          const Place place = Project(camera, b, p_HQ, &circle);
          if (place == Place::kInside)
            batch.Add(circle.u, circle.v, circle.radius, static_cast<int>(i));
          else if (place == Place::kPartly)
            match[i] += MatchPointByPoint(camera, b, circle);
        }
        AddMatches(samples_.u.data(), samples_.v.data(), camera.labels->data(),
                   camera.labels->width(), b, batch, match.data());
      }
    for (size_t i = 0; i < poses; ++i) fitness[begin + i] = FitnessOfMatches(match[i]);
  }
}

FitnessByBall Fitness::EvaluateByBall(const Pose& X_HM) const {
  const Eigen::Matrix3d R_HM = X_HM.R();
  FitnessByBall by_ball;
  for (int b = 0; b < ball_count_; ++b) {
    const Eigen::Vector3d p_HQ = R_HM * p_MQ_m_[b] + X_HM.p;
    for (const Side side : kSides)
      by_ball.in[side][b] = FitnessFromMatch(Match(cameras_[side], b, p_HQ));
  }
  by_ball.fitness = Evaluate(X_HM);
  return by_ball;
}

}  // namespace turbidock::vision
