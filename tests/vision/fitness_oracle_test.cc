// The values of F that follow from its definition, exactly.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/base/camera.h"
#include "vision/fitness.h"

namespace turbidock::vision {
namespace {

constexpr int kAllBalls = 0b111;

class FitnessOracle : public ::testing::Test {
 protected:
  // Labels of the pixels within `radius_factor` of each ball's radius, for a marker at X_HM.
  void PaintBalls(const Pose& X_HM, double radius_factor, int balls = kAllBalls) {
    PaintView(rig_.left, rig_.left.X_HC, X_HM, radius_factor, balls, &labels_.left);
    PaintView(rig_.right, rig_.right.X_HC, X_HM, radius_factor, balls, &labels_.right);
  }
  static void Fill(uint8_t label, Image1u8* labels) {
    std::fill(labels->data(), labels->data() + labels->pixels(), label);
  }

  MarkerParams marker_;
  StereoRig rig_ = RigParams{}.MakeRig();
  Stereo<Image1u8> labels_{{640, 480}, {640, 480}};
  Fitness fitness_{marker_, rig_, labels_};
  Pose X_HM_ = Pose::FromVectorPart({0.6, 0.03, -0.02}, {0.01, -0.02, 0.05});

 private:
  void PaintView(const CameraIntrinsics& camera, const Pose& X_HC, const Pose& X_HM, double factor,
                 int balls, Image1u8* labels) {
    for (int b = 0; b < 3; ++b) {
      if (!(balls >> b & 1)) continue;
      const Eigen::Vector3d p_HQ = X_HM * marker_.balls[b].p_MQ_m;
      const Eigen::Vector3d p_CQ = X_HC.Inverse() * p_HQ;
      const double u_px = camera.fx_px * p_CQ.x() / p_CQ.z() + camera.cx_px;
      const double v_px = camera.fy_px * p_CQ.y() / p_CQ.z() + camera.cy_px;
      const double radius_px = factor * camera.fx_px * 0.02 / p_CQ.z();
      for (int v = 0; v < labels->height(); ++v)
        for (int u = 0; u < labels->width(); ++u)
          if (std::hypot(u - u_px, v - v_px) <= radius_px)
            *labels->at(u, v) |= static_cast<uint8_t>(1 << b);
    }
  }
};

TEST_F(FitnessOracle, NothingInAnyHueIsMinusOneFifth) { EXPECT_EQ(fitness_.Evaluate(X_HM_), -0.2); }

TEST_F(FitnessOracle, EverythingInTheHueIsPlusOneFifth) {
  Fill(kAllBalls, &labels_.left);
  Fill(kAllBalls, &labels_.right);
  EXPECT_EQ(fitness_.Evaluate(X_HM_), 0.2);
}

TEST_F(FitnessOracle, BallsAndNothingElseIsOne) {
  PaintBalls(X_HM_, 1.2);
  EXPECT_EQ(fitness_.Evaluate(X_HM_), 1);
}

TEST_F(FitnessOracle, OuterRingAloneIsMinusOne) {
  Fill(kAllBalls, &labels_.left);
  Fill(kAllBalls, &labels_.right);
  Image1u8 left_all = labels_.left, right_all = labels_.right;
  Fill(0, &labels_.left);
  Fill(0, &labels_.right);
  PaintBalls(X_HM_, 1.2);
  for (size_t i = 0; i < labels_.left.pixels(); ++i) {
    labels_.left.data()[i] ^= left_all.data()[i];
    labels_.right.data()[i] ^= right_all.data()[i];
  }
  EXPECT_EQ(fitness_.Evaluate(X_HM_), -1);
}

TEST_F(FitnessOracle, TwoOfThreeBallsIsThreeFifthsAndOneIsOneFifth) {
  PaintBalls(X_HM_, 1.2, 0b011);
  EXPECT_DOUBLE_EQ(fitness_.Evaluate(X_HM_), 0.6);  // (1 + 1 - 0.2) / 3
  Fill(0, &labels_.left);
  Fill(0, &labels_.right);
  PaintBalls(X_HM_, 1.2, 0b100);
  EXPECT_DOUBLE_EQ(fitness_.Evaluate(X_HM_), 0.2);  // (1 - 0.2 - 0.2) / 3
}

TEST_F(FitnessOracle, OneCameraBlindIsTwoFifths) {
  PaintBalls(X_HM_, 1.2);
  Fill(0, &labels_.right);
  EXPECT_DOUBLE_EQ(fitness_.Evaluate(X_HM_), 0.4);  // (1 - 0.2) / 2
  const FitnessByBall by_ball = fitness_.EvaluateByBall(X_HM_);
  for (int b = 0; b < 3; ++b) {
    EXPECT_EQ(by_ball.in.left[b], 1);
    EXPECT_EQ(by_ball.in.right[b], -0.2);
    EXPECT_DOUBLE_EQ(by_ball.ball(b), 0.4);
  }
}

TEST_F(FitnessOracle, ABallsBitCountsForThatBallOnly) {
  PaintBalls(X_HM_, 1.2);
  for (size_t i = 0; i < labels_.left.pixels(); ++i) {  // green's and red's labels change places
    for (Image1u8* labels : {&labels_.left, &labels_.right}) {
      uint8_t& label = labels->data()[i];
      label = static_cast<uint8_t>((label & 4) | (label & 1) << 1 | (label & 2) >> 1);
    }
  }
  EXPECT_DOUBLE_EQ(fitness_.Evaluate(X_HM_), 0.2);  // only blue is left
}

TEST_F(FitnessOracle, OutsideTheImageAndBehindTheCameraNothingMatches) {
  Fill(0xff, &labels_.left);
  Fill(0xff, &labels_.right);
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(0.6, 5, 0), Eigen::Vector3d(0.6, -5, 0), Eigen::Vector3d(0.6, 0, 5),
        Eigen::Vector3d(0.6, 0, -5), Eigen::Vector3d(-0.6, 0, 0), Eigen::Vector3d(-1e6, 3, 2)})
    EXPECT_EQ(fitness_.Evaluate({Eigen::Quaterniond::Identity(), p}), -0.2) << p.transpose();
}

TEST(FitnessAtTheBorder, PointsBeyondTheLastPixelDoNotMatch) {
  // One ball whose circle of 20 px slides over the edges of both images of a rig without baseline.
  // All pixels match, so F counts the points whose nearest pixel exists.
  MarkerParams marker;
  marker.balls = {{"one", {0, 0, 0}, 0.02, 0, {1, 1, 1}}};
  StereoRig rig = RigParams{}.MakeRig();
  rig.right.X_HC = rig.left.X_HC;
  const Stereo<Image1u8> all{{640, 480, 1}, {640, 480, 1}};
  const Fitness fitness(marker, rig, all);
  const SamplePoints samples(marker);
  const double radius_px = 20, depth_m = rig.left.fx_px * 0.02 / radius_px;
  int checked = 0, partial = 0;
  const auto check = [&](double u_px, double v_px) {
    int inner = 0, outer = 0;
    for (int i = 0; i < kBallPoints; ++i) {
      const double u = u_px + radius_px * samples.u[i], v = v_px + radius_px * samples.v[i];
      if (u < -0.5 || v < -0.5 || u >= 639.5 || v >= 479.5) continue;
      ++(i < kInnerPoints ? inner : outer);
    }
    const Eigen::Vector3d p_CQ = depth_m * rig.left.RayAt(u_px, v_px);
    const Pose X_HM = rig.left.X_HC * Pose{Eigen::Quaterniond::Identity(), p_CQ};
    EXPECT_NEAR(fitness.Evaluate(X_HM), ((2 * inner - 36) - (2 * outer - 24)) / 60.0, 1e-12)
        << u_px << ' ' << v_px;
    ++checked;
    partial += inner + outer > 0 && inner + outer < kBallPoints;
  };
  for (int i = 0; i < 180; ++i) {
    const double beyond_px = -33.017 + 0.371 * i;
    check(beyond_px, 240.3);
    check(640.2 + beyond_px, 240.3);
    check(320.3, beyond_px);
    check(320.3, 480.2 + beyond_px);
    check(beyond_px, beyond_px);
  }
  EXPECT_EQ(checked, 900);
  EXPECT_GT(partial, 600);
}

}  // namespace
}  // namespace turbidock::vision
