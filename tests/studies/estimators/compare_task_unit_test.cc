#include "experiments/studies/estimators/compare_task.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "experiments/studies/recognition/recognition.h"
#include "vision/gene.h"

namespace turbidock::estimators {
namespace {

constexpr int kStarts = 50;

class CompareTaskTest : public ::testing::Test {
 protected:
  std::vector<Pose> Draw(CompareTask task, double distance_m, int frames) {
    return DrawStart(task, distance_m, frames, scenario_, rig_, &rng_);
  }

  // How many of the balls' six centres are in the images. By cosines of the half angle of view and
  // not by ProjectBall.
  int CentresInSight(const Pose& X_HM) const {
    int count = 0;
    for (const auto& [camera, X_HC] :
         {std::pair{rig_.left, rig_.left.X_HC}, std::pair{rig_.right, rig_.right.X_HC}})
      for (const vision::BallParams& ball : scenario_.marker.balls) {
        const Eigen::Vector3d p_CQ = X_HC.Inverse() * (X_HM * ball.p_MQ_m);
        const double right = p_CQ.x() / p_CQ.z(), down = p_CQ.y() / p_CQ.z();
        const double u_px = camera.cx_px + camera.fx_px * right;
        const double v_px = camera.cy_px + camera.fy_px * down;
        count += p_CQ.z() > 0 && u_px >= 0 && u_px <= camera.width_px - 1 && v_px >= 0 &&
                 v_px <= camera.height_px - 1;
      }
    return count;
  }

  trial::Scenario scenario_ =
      recognition::RecognitionScenario(recognition::MarkerKind::kActive, {});
  StereoRig rig_ = scenario_.rig.MakeRig();
  Rng rng_ = SeedTree(5).Stream("starts");
};

TEST_F(CompareTaskTest, AMarkerAtRestIsAboutTheDistance) {
  for (int i = 0; i < kStarts; ++i) {
    const std::vector<Pose> start = Draw(CompareTask::kStill, 0.8, 30);
    ASSERT_EQ(start.size(), 1u);
    EXPECT_NEAR(start[0].p.x(), 0.8, 0.04 + 1e-12);
    EXPECT_EQ(CentresInSight(start[0]), 6);
  }
}

TEST_F(CompareTaskTest, AnywhereFillsTheSearchRange) {
  const vision::GeneMap map(scenario_.estimator.range);
  vision::GeneMap::Values least = map.high(), most = map.low();
  for (int i = 0; i < 10 * kStarts; ++i) {
    const std::vector<Pose> start = Draw(CompareTask::kAnywhere, 0, 30);
    ASSERT_EQ(start.size(), 1u);
    EXPECT_GE(CentresInSight(start[0]), 4);
    const vision::GeneMap::Values values = vision::GeneMap::ValuesOf(start[0]);
    for (size_t k = 0; k < values.size(); ++k) {
      EXPECT_GE(values[k], map.low()[k] - 1e-12);
      EXPECT_LE(values[k], map.high()[k] + 1e-12);
      least[k] = std::min(least[k], values[k]);
      most[k] = std::max(most[k], values[k]);
    }
  }
  for (size_t k = 0; k < least.size(); ++k)
    EXPECT_GT(most[k] - least[k], 0.8 * (map.high()[k] - map.low()[k])) << k;
}

TEST_F(CompareTaskTest, AMovingMarkerKeepsItsSpeedAndStaysInSight) {
  for (int i = 0; i < 10; ++i) {
    // So near that not every motion would do.
    const std::vector<Pose> path = Draw(CompareTask::kMoving, 0.4, 90);
    ASSERT_EQ(path.size(), 90u);
    int straight = 0, turning = 0;
    for (size_t k = 0; k < path.size(); ++k) {
      EXPECT_EQ(CentresInSight(path[k]), 6);
      if (k == 0) continue;
      // Less only where it turns back within a frame.
      const double speed_m_s = 30 * (path[k].p - path[k - 1].p).norm();
      const double turn_rad_s = 30 * AngleBetween(path[k].q, path[k - 1].q);
      EXPECT_LE(speed_m_s, kMovingSpeed_m_s + 1e-9);
      EXPECT_LE(turn_rad_s, kMovingTurn_rad_s + 1e-6);
      straight += speed_m_s > kMovingSpeed_m_s - 1e-9;
      turning += turn_rad_s > kMovingTurn_rad_s - 1e-6;
    }
    EXPECT_GE(straight, 84);
    EXPECT_GE(turning, 84);
  }
}

TEST_F(CompareTaskTest, AnAbsentMarkerIsNotInSight) {
  for (int i = 0; i < 10 * kStarts; ++i) {
    const std::vector<Pose> start = Draw(CompareTask::kAbsent, 0, 30);
    ASSERT_EQ(start.size(), 1u);
    EXPECT_EQ(CentresInSight(start[0]), 0);
    EXPECT_GT(start[0].p.norm(), 0.4);
  }
}

TEST_F(CompareTaskTest, TheSameStreamDrawsTheSameStarts) {
  for (const CompareTask task :
       {CompareTask::kStill, CompareTask::kAnywhere, CompareTask::kMoving, CompareTask::kAbsent}) {
    Rng a = SeedTree(8).Stream("starts"), b = SeedTree(8).Stream("starts");
    const std::vector<Pose> first = DrawStart(task, 0.6, 5, scenario_, rig_, &a);
    const std::vector<Pose> second = DrawStart(task, 0.6, 5, scenario_, rig_, &b);
    ASSERT_EQ(first.size(), second.size());
    EXPECT_EQ(first.back().p, second.back().p);
    EXPECT_EQ(first.back().q.coeffs(), second.back().q.coeffs());
  }
}

}  // namespace
}  // namespace turbidock::estimators
