#pragma once
// The approach: from somewhere near to where the marker is found, by navigation.

#include <cstdint>
#include <optional>
#include <string>

#include "control/axes.h"
#include "control/navigator.h"
#include "control/pid.h"
#include "sim/base/axes_pose.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"
#include "sim/base/units.h"

namespace turbidock::control {

enum class ApproachMode {
  kNone,        // it waits and turns where it is
  kNavigation,  // by itself, to the dock's axis, along it, and about it in search of the marker
  kPilot,       // published: somebody brings it nearer along the axis, by hand
};
constexpr auto Names(ApproachMode) {
  using enum ApproachMode;
  return EnumList<ApproachMode>({{kNone, "none"}, {kNavigation, "navigation"}, {kPilot, "pilot"}});
}

// Distances are of the marker ahead of the camera head, as navigation has it.
struct ApproachParams {
  // Steers to within a few centimetres of what navigation says, and slowly: a stiffer loop would
  // follow its noise. Guesses, as accelerations: critically damped within 2 to 4 s.
  static PidParams SlowController() {
    PidParams pid;
    pid.surge = {.kp_per_s2 = 0.3, .ki_per_s3 = 0.02, .kd_per_s = 0.8};
    pid.sway = pid.surge;
    pid.heave = {.kp_per_s2 = 0.6, .ki_per_s3 = 0.05, .kd_per_s = 1.2};
    pid.yaw = {.kp_per_s2 = 1, .ki_per_s3 = 0.05, .kd_per_s = 1.6};
    pid.setpoint.enabled = true;
    return pid;
  }

  ApproachMode mode = ApproachMode::kNone;
  double staging_x_m = 1.8;       // guess: a little farther than the marker is found from
  double nearest_x_m = 1.1;       // guess: the station is 0.5 m nearer
  double advance_mps = 0.06;      // guess: 6 cm a second
  double arrived_m = 0.15;        // guess
  double leg_time_s = 60;         // guess: twice what 5 m take
  double sweep_rad = 0.2;         // guess: what is seen moves by 0.2 m at 1 m
  double sweep_period_s = 20;     // guess: slow enough for the estimator to follow
  double box_step_m = 0.3;        // guess: less than half of the view at 1 m
  int box_steps = 3;              // guess: three standard deviations of 0.3 m
  double box_height_share = 0.3;  // guess: a depth is known better than a place
  double closer_m = 0.2;          // guess: what it was not seen from so far
  // By hand.
  double hand_interval_s = 0.5;  // guess: a movement of the sticks takes so long
  double hand_delay_s = 0.3;     // guess: reaction to what is seen
  double hand_step_share = 0.1;  // guess: as fine as a stick is moved
  NavigatorParams navigator;
  PidParams controller = SlowController();

  static void Fields(auto& self, auto&& field) {
    field("mode", self.mode, Range{},
          "way to where the marker is found. none: the vehicle waits and turns where it is; "
          "navigation: to the dock's axis, along it, and about it in search of the marker; pilot: "
          "a simulated pilot brings it nearer along the axis");
    field("staging_x_m", self.staging_x_m, InRange(0.1, 50),
          "approach by navigation: distance in front of the marker (its x) at which the way along "
          "the dock's axis begins");
    field("nearest_x_m", self.nearest_x_m, InRange(0.05, 50),
          "approach: distance in front of the marker (its x) at which the way along the dock's "
          "axis ends");
    field("advance_mps", self.advance_mps, InRange(0.001, 1),
          "approach: speed along the dock's axis");
    field("arrived_m", self.arrived_m, InRange(0.001, 10),
          "approach: distance from the end of a leg within which the next leg begins");
    field("leg_time_s", self.leg_time_s, InRange(1, 3600),
          "approach: time at the end of a leg after which the next leg begins anyway");
    field("sweep_rad", self.sweep_rad, InRange(0, 3.1),
          "search after the approach: largest turn to either side at the end of the dock's axis");
    field("sweep_period_s", self.sweep_period_s, InRange(1, 3600),
          "search after the approach: period of the turn to either side at the end of the dock's "
          "axis");
    field("box_step_m", self.box_step_m, InRange(0.01, 10),
          "search after the approach: half width of the first box about the dock's axis, and by "
          "how much each next box is wider");
    field("box_steps", self.box_steps, InRange(0, 100),
          "search after the approach: number of boxes, each wider and nearer than the last, before "
          "the first comes again; 0: the vehicle only turns");
    field("box_height_share", self.box_height_share, InRange(0, 10),
          "search after the approach: height of a box about the dock's axis, as a share of its "
          "width");
    field("closer_m", self.closer_m, InRange(0, 10),
          "search after the approach: distance by which the way along the dock's axis ends nearer "
          "each time");
    field("hand_interval_s", self.hand_interval_s, InRange(0, 10),
          "simulated pilot: time for which the sticks stay as they are");
    field("hand_delay_s", self.hand_delay_s, InRange(0, 10),
          "simulated pilot: time from seeing to moving the sticks");
    field(
        "hand_step_share", self.hand_step_share, InRange(0.001, 1),
        "simulated pilot: smallest movement of a stick, as a share of the vehicle's largest force");
    field("navigator", self.navigator, Finite(), "filter from navigation's readings to a pose");
    field("pid", self.controller, Finite(),
          "PID controller that steers by navigation; its gains are accelerations");
  }
  void Check(const std::string& path) const;
  double closest_x_m() const;  // of all rounds

  bool on() const { return mode != ApproachMode::kNone; }
};

// x of the marker where the way along the axis ends in a round.
double NearestX_m(const ApproachParams& params, int round);

// Corner `leg` of box `round` about the axis, y and z of the camera head in M: right, and then
// round by the top, the left and the bottom to where it began; legs 0 to 5, the last on the axis.
inline constexpr int kBoxLegs = 6;
Eigen::Vector2d BoxCorner(const ApproachParams& params, int round, int leg);

// Where to go, frame by frame:
//
//   staging --> along the axis --> turn to both sides --> box --.
//      ^---- back off, and next time nearer and a wider box ----'
//
// A pilot goes along the axis from where it is, turns to both sides at its end, and goes nearer.
// Whether the marker is found is not asked here.
class Approach {
 public:
  Approach(const ApproachParams& params, const AxesPose& axis_HM, const ClockParams& clock);

  bool on() const { return params_.on(); }
  void Begin();  // from wherever the vehicle is

  // The pose of the camera head in M that is wanted at a frame. Frames must increase.
  const AxesPose& Update(int64_t frame, const AxesPose& now_MH);
  // The same while the marker may just have been found: where the vehicle is, and the leg goes on
  // afterwards.
  const AxesPose& Hold(int64_t frame, const AxesPose& now_MH);

  bool searching() const { return leg_ == Leg::kSweep || leg_ == Leg::kBox; }
  std::string description() const;  // of the leg

 private:
  enum class Leg { kStaging, kAxis, kSweep, kBox };
  void Enter(Leg leg, const AxesPose& now_MH);
  AxesPose OnAxis(double x_m) const;
  AxesPose Goal() const;
  bool Arrived(const AxesPose& now_MH) const;
  void Next(const AxesPose& now_MH);
  double nearest_x_m() const { return NearestX_m(params_, round_); }
  double leg_s() const { return static_cast<double>(leg_frames_) * clock_.frame_s(); }

  ApproachParams params_;
  AxesPose axis_HM_;  // of the marker in the camera head on the dock's axis, whatever its x
  ClockParams clock_;
  Leg leg_ = Leg::kStaging;
  int round_ = 0, corner_ = 0;
  double from_x_m_ = 0;  // where the way along the axis began
  int64_t leg_frames_ = 0;
  std::optional<int64_t> last_frame_;
  bool begun_ = false, held_ = false;
  AxesPose wanted_MH_;
};

// The sticks of a pilot: a demand that changes every interval, late and in steps.
class Hand {
 public:
  Hand(const ApproachParams& params, const ClockParams& clock);

  // What the thrusters are asked for when `wanted` would be right; frames must increase.
  Axes Move(int64_t frame, const Axes& wanted, const Axes& most);

 private:
  ApproachParams params_;
  ClockParams clock_;
  std::optional<int64_t> moved_;  // when the pilot last decided
  Axes decided_ = Axes::Zero(), given_ = Axes::Zero();
};

}  // namespace turbidock::control
