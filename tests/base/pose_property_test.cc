#include "sim/base/pose.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sim/base/frames.h"
#include "tests/support/awkward.h"

namespace turbidock {
namespace {

// Rounding of a few products of positions up to 1 km.
constexpr double kRoundTrip = 1e-9;

void ExpectPoseNear(const Pose& a, const Pose& b, double tolerance) {
  EXPECT_LE((a.p - b.p).norm(), tolerance);
  EXPECT_LE(AngleBetween(a.q, b.q), tolerance);
}

TEST(PoseLaw, InverseAndComposition) {
  const auto poses = testing::AwkwardPoses();
  ASSERT_GE(poses.size(), 50u);
  for (const Pose& X_AB : poses) {
    ExpectPoseNear(X_AB * X_AB.Inverse(), Pose{}, kRoundTrip);
    ExpectPoseNear(X_AB.Inverse() * X_AB, Pose{}, kRoundTrip);
    for (const Pose& X_BC : poses) {
      const Eigen::Vector3d p_CQ(0.1, -0.2, 0.3);
      EXPECT_LE(((X_AB * X_BC) * p_CQ - X_AB * (X_BC * p_CQ)).norm(), kRoundTrip);
    }
  }
}

TEST(PoseLaw, CanonicalIsTheSameRotationWithNonNegativeW) {
  for (const Pose& X : testing::AwkwardPoses()) {
    const Pose c = X.Canonical();
    EXPECT_GE(c.q.w(), 0);
    EXPECT_LE(AngleBetween(c.q, X.q), 1e-12);
    EXPECT_NEAR(c.q.norm(), 1, 1e-15);
  }
}

TEST(PoseLaw, VectorPartRoundTrip) {
  for (const Pose& X : testing::AwkwardPoses()) {
    const Pose c = X.Canonical();
    // The root loses half the digits at a half turn.
    ExpectPoseNear(Pose::FromVectorPart(c.p, c.q.vec()), c, 1e-7);
  }
  EXPECT_DOUBLE_EQ(Pose::FromVectorPart({0, 0, 0}, {0, 0, 5}).q.z(), 1);
}

TEST(PoseLaw, YawPitchRoll) {
  for (const double yaw : {-3.0, -0.4, 0.0, 1e-9, 2.0})
    for (const double pitch : {-1.2, 0.0, 0.7})
      for (const double roll : {-2.0, 0.0, 0.3}) {
        const auto q = FromYawPitchRoll(yaw, pitch, roll);
        EXPECT_NEAR(YawOf(q), yaw, 1e-12);
        EXPECT_NEAR(YawOf({-q.w(), -q.x(), -q.y(), -q.z()}), yaw, 1e-12);
      }
}

TEST(PoseLaw, AngleBetweenKnownRotations) {
  const Eigen::Quaterniond a(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond b(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()));
  EXPECT_NEAR(AngleBetween(a, b), 0.3, 1e-15);
  EXPECT_NEAR(AngleBetween(a, {-b.w(), -b.x(), -b.y(), -b.z()}), 0.3, 1e-15);
}

TEST(PoseLaw, OpticalAxesInTheHead) {
  const Eigen::Matrix3d R_HL = HeadFromOptical();
  EXPECT_EQ(R_HL.col(2), Eigen::Vector3d::UnitX());   // forward
  EXPECT_EQ(R_HL.col(0), -Eigen::Vector3d::UnitY());  // right
  EXPECT_EQ(R_HL.col(1), -Eigen::Vector3d::UnitZ());  // down
  EXPECT_DOUBLE_EQ(R_HL.determinant(), 1);
}

}  // namespace
}  // namespace turbidock
