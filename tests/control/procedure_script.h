#pragma once
// Scripted estimates for the docking procedure.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "control/docking_procedure.h"

namespace turbidock::control {

inline constexpr ClockParams kClock;  // 30 frames a second

// Feeds a procedure one estimate a frame.
class Script {
 public:
  explicit Script(const ProcedureParams& params = {}, int64_t first_frame = 0)
      : procedure_(params, kClock), frame_(first_frame) {}

  const Directive& Pose(double x_m, double y_m = 0, double z_m = 0, double yaw_rad = 0,
                        double fitness = 0.8) {
    PoseEstimate estimate;
    estimate.frame = frame_++;
    estimate.X_HM = {FromYawPitchRoll(yaw_rad, 0, 0), {x_m, y_m, z_m}};
    estimate.fitness = fitness;
    return directive_ = procedure_.Update(estimate);
  }
  const Directive& Fitness(double fitness) { return Pose(0.6, 0, 0, 0, fitness); }
  const Directive& Lost() { return Fitness(0.21); }
  void Repeat(int n, double x_m, double y_m = 0) {
    for (int i = 0; i < n; ++i) Pose(x_m, y_m);
  }
  void LostFor(int n) {
    for (int i = 0; i < n; ++i) Lost();
  }
  void SkipFrames(int n) { frame_ += n; }

  // Into the stage by the shortest way.
  void ToServoing() {
    Repeat(15, 1.0);
    ASSERT_EQ(directive_.stage, Stage::kVisualServoing);
  }
  void ToDocking() {
    ToServoing();
    Repeat(5, 0.6);
    ASSERT_EQ(directive_.stage, Stage::kDocking);
  }
  const Directive& directive() const { return directive_; }
  int64_t frame() const { return frame_ - 1; }

 private:
  DockingProcedure procedure_;
  Directive directive_;
  int64_t frame_;
};

inline void ExpectTransition(const Script& script, Stage from, Stage to) {
  const auto& transition = script.directive().transition;
  ASSERT_TRUE(transition.has_value());
  EXPECT_EQ(transition->frame, script.frame());
  EXPECT_EQ(transition->from, from);
  EXPECT_EQ(transition->to, to);
  EXPECT_FALSE(transition->reason.empty());
  EXPECT_EQ(script.directive().stage, to);
}

inline void ExpectDrift(const Directive& directive) {
  EXPECT_FALSE(directive.control);
  EXPECT_EQ(directive.open_loop, AxisVolts{});
}

}  // namespace turbidock::control
