#pragma once
// The docking procedure: which pose is wanted, when, and why the stage changed.

#include <cstdint>
#include <optional>
#include <string>

#include "control/approach.h"
#include "control/axis_volts.h"
#include "control/stage.h"
#include "sim/base/axes_pose.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"
#include "sim/base/pose_estimate.h"
#include "sim/base/published.h"
#include "sim/base/units.h"

namespace turbidock::control {

// Lengths are of the marker's position in the camera head, yaw is its heading there. Sources:
// "paper" is the publication reproduced, "earlier" its group's earlier papers as recalled, "guess"
// is ours.
struct ProcedureParams {
  // approach: find the marker
  double found_fitness =
      published::kReliableFitness;  // lower limit of Area I, where docking is possible
  double found_hold_s = 0.5;        // guess: the search converges from a random start in some 0.5 s
  double search_neutral_s = 5;      // guess
  double search_yaw_v = 0.5;        // guess: twice the dead band
  double search_period_s = 24;      // guess: slow enough for the estimator to follow
  // visual servoing: stand still in front of the dock
  double servo_x_m = 0.60;  // earlier
  double servo_y_m = 0;
  double servo_z_m = 0;  // earlier: -0.067 in places
  double servo_yaw_rad = 0;
  double enter_x_m = 0.05;                      // guess
  double enter_y_m = 0.02;                      // earlier
  double enter_z_m = 0.02;                      // earlier
  double enter_yaw_rad = units::RadFromDeg(7);  // earlier
  double enter_hold_s = 0.165;                  // five cycles of 33 ms; earlier
  // docking: lower the desired x
  double docking_rate_mps = 0.03;  // earlier
  double docking_x_m = published::kDockDistance_m;
  double allowance_y_m = published::kDockTolerance_m;
  double allowance_z_m = published::kDockTolerance_m;
  double allowance_yaw_rad = units::RadFromDeg(15);  // guess
  // docked
  double docked_x_m = published::kDockDistance_m;
  double docked_y_m = published::kDockTolerance_m;
  double docked_z_m = published::kDockTolerance_m;
  int docked_hold_frames = 1;  // paper: "reaches"
  // trying again: not published
  double stuck_s = 0;
  double stuck_x_m = 0.03;  // guess: more than the servo's error at the published rate
  int attempts = 0;
  // docking cycles: not published
  int cycles = 1;
  double stay_s = 3;  // guess
  // loss of the marker
  double lost_fitness =
      published::kDetectedFitness;  // lower limit of Area II, below which it is not detected
  double lost_after_s = 1;          // guess: long enough for the search to converge again
  double return_to_approach_s = 5;  // guess
  double give_up_s = 15;            // guess
  double blind_max_s = 0;           // not published
  double blind_rate_mps = 0.08;     // guess: what is predicted errs by more the longer it takes

  static void Fields(auto& self, auto&& field) {
    field("found_fitness", self.found_fitness, InRange(-1, 1),
          "approach: fitness F at which the marker counts as found");
    field("found_hold_s", self.found_hold_s, InRange(0, 600),
          "approach: time the marker must stay found to begin servoing");
    field("search_neutral_s", self.search_neutral_s, InRange(0, 3600),
          "approach: time to wait at neutral voltage before the vehicle turns to search");
    field("search_yaw_v", self.search_yaw_v, InRange(0, 2.5),
          "approach: amplitude of the yaw voltage with which the vehicle turns to search; 0: it "
          "never searches");
    field("search_period_s", self.search_period_s, InRange(1, 3600),
          "approach: period of the yaw with which the vehicle turns to search");
    field("servo_x_m", self.servo_x_m, InRange(0.05, 10),
          "servoing: desired x of the marker in the camera head (forward)");
    field("servo_y_m", self.servo_y_m, InRange(-2, 2),
          "servoing and docking: desired y of the marker in the camera head (left)");
    field("servo_z_m", self.servo_z_m, InRange(-2, 2),
          "servoing and docking: desired z of the marker in the camera head (up)");
    field("servo_yaw_rad", self.servo_yaw_rad, InRange(-1, 1),
          "servoing and docking: desired heading of the marker in the camera head, positive to the "
          "left");
    field("enter_x_m", self.enter_x_m, Above(0),
          "servoing: error in the marker's x below which docking may begin");
    field("enter_y_m", self.enter_y_m, Above(0),
          "servoing: error in the marker's y below which docking may begin");
    field("enter_z_m", self.enter_z_m, Above(0),
          "servoing: error in the marker's z below which docking may begin");
    field("enter_yaw_rad", self.enter_yaw_rad, Above(0),
          "servoing: error in the marker's heading below which docking may begin");
    field("enter_hold_s", self.enter_hold_s, InRange(0, 600),
          "servoing: time that all errors must stay below enter_* for docking to begin");
    field("docking_rate_mps", self.docking_rate_mps, InRange(0.001, 1),
          "docking: speed at which the marker's desired x is lowered");
    field("docking_x_m", self.docking_x_m, InRange(0.05, 10),
          "docking: desired x of the marker in the camera head at the end");
    field("allowance_y_m", self.allowance_y_m, Above(0),
          "docking: error in the marker's y beyond which the vehicle goes back to servoing");
    field("allowance_z_m", self.allowance_z_m, Above(0),
          "docking: error in the marker's z beyond which the vehicle goes back to servoing");
    field("allowance_yaw_rad", self.allowance_yaw_rad, Above(0),
          "docking: error in the marker's heading beyond which the vehicle goes back to servoing");
    field("docked_x_m", self.docked_x_m, InRange(0.05, 10),
          "docking: x of the marker in the camera head at which the vehicle is docked");
    field("docked_y_m", self.docked_y_m, Above(0),
          "docking: error in the marker's y within which the vehicle is docked");
    field("docked_z_m", self.docked_z_m, Above(0),
          "docking: error in the marker's z within which the vehicle is docked");
    field("docked_hold_frames", self.docked_hold_frames, InRange(1, 1000),
          "docking: number of successive estimates within docked_* after which the vehicle is "
          "docked");
    field("stuck_s", self.stuck_s, InRange(0, 600),
          "docking: time without progress, farther than stuck_x_m from the desired x, after which "
          "the vehicle backs off to try again; 0: never");
    field("stuck_x_m", self.stuck_x_m, Above(0),
          "docking: distance from the marker's desired x beyond which the vehicle may count as "
          "stuck");
    field("attempts", self.attempts, InRange(0, 1000),
          "docking: number of attempts until the trial is given up; 0: any number");
    field("cycles", self.cycles, InRange(1, 10000),
          "number of dockings in a trial; before each but the first the vehicle undocks");
    field("stay_s", self.stay_s, InRange(0, 86400),
          "docked: time until the vehicle undocks for the next cycle");
    field("lost_fitness", self.lost_fitness, InRange(-1, 1),
          "fitness F below which an estimate is not used");
    field("lost_after_s", self.lost_after_s, InRange(0, 3600),
          "time without a usable estimate after which docking goes back to servoing");
    field("return_to_approach_s", self.return_to_approach_s, InRange(0, 3600),
          "time without a usable estimate after which servoing goes back to approach");
    field("give_up_s", self.give_up_s, InRange(0, 3600),
          "time without a usable estimate after which a marker that was found is given up; not "
          "while there is a navigation to search it with");
    field("blind_max_s", self.blind_max_s, InRange(0, 600),
          "docking: time without a usable estimate for which the vehicle goes on by the "
          "controller's own prediction of where the marker is; 0: it drifts at once");
    field("blind_rate_mps", self.blind_rate_mps, InRange(0.001, 1),
          "docking: speed at which the marker's desired x is lowered without a usable estimate");
  }

  // What must hold between them: servo x beyond docking x, limits of entry within the allowances,
  // thresholds and times of loss in order.
  void Check(const std::string& path) const;
};

// A change of stage and its reason, a sentence with the numbers that decided.
struct Transition {
  int64_t frame = 0;
  Stage from = Stage::kApproach, to = Stage::kApproach;
  std::string reason;

  bool operator==(const Transition&) const = default;

  static void Fields(auto& self, auto&& field) {
    field("frame", self.frame, Finite(), "frame at which the stage changed");
    field("from", self.from, Finite(), "stage before the change");
    field("to", self.to, Finite(), "stage after the change");
    field("reason", self.reason, Finite(), "reason of the change of stage, a sentence for people");
  }
};

// What the vehicle steers by.
enum class Guide {
  kVision,      // the estimate
  kNavigation,  // where it is without having seen the marker
  kPrediction,  // where the controller's model of the vehicle says that the marker is by now
};

// What is known of the marker besides the estimate.
struct Outlook {
  std::optional<AxesPose> navigated_MH = {};  // the camera head in the marker's frame
  std::optional<AxesPose> predicted_HM = {};  // the marker in the camera head
};

// What to do at a frame.
struct Directive {
  Stage stage = Stage::kApproach;
  bool control = false;                  // true: servo on `desired`; false: apply `open_loop`
  Guide guide = Guide::kVision;          // under control
  AxesPose desired;                      // of the stage, also while `control` is false
  AxisVolts open_loop;                   // zero (drift) except in the search
  std::optional<Transition> transition;  // the change made at this frame, if any
  bool marker_seen = false;              // the fitness of this frame is at least lost_fitness
  bool trusted = false;     // seen, and in approach also found: filters may learn from the estimate
  int64_t frames_lost = 0;  // since the marker was last seen; 0 while it is
  double best_fitness = -1;     // of all frames so far
  int dockings = 0;             // times that it docked
  bool done = false;            // docked as often as it shall
  bool given_up = false;        // the marker has been lost for good, or all attempts failed
  std::string given_up_reason;  // a sentence, empty until then
};

// The state machine of the docking trial.
//
//   approach  -- found -->  visual servoing  -- stable -->  docking  -- criterion -->  docked
//    |    ^---- lost for long ------'  ^-- allowance, lost, stuck --'                       |
//   search  -- found --> as above      '------------------- undocking <--- next cycle -----'
//
// An estimate with F < lost_fitness is no pose: the vehicle never acts on it. From that frame on it
// drifts at neutral, the desired x stands still and holds start again, until a usable estimate
// comes; the stage changes only when the loss lasts: docking to visual servoing after lost_after_s,
// to approach after return_to_approach_s, and given_up (for good, at neutral) after give_up_s if it
// was ever found. In approach nothing is controlled: neutral for search_neutral_s, then an
// alternating yaw search_yaw_v cos(2 pi t / search_period_s), interrupted while F >= found_fitness.
// With a navigation to steer by (control/approach.h) it goes to the marker and about it instead,
// the stage is `search` wherever it should have been found by then, and a loss that lasts for
// lost_after_s is answered by holding the desired pose by navigation. With blind_max_s a loss while
// docking is bridged by the controller's prediction, which then also meets the criterion.
// Where there are to be more cycles, it undocks after stay_s: the desired x is raised as it was
// lowered, and from the servoing pose it docks again. Docked is final in the last cycle; the last
// desired pose is still held. At most one change of stage a frame.
//
// Time is the difference of frame numbers; holds (found, stable, docked) count successive
// estimates.
class DockingProcedure {
 public:
  // Checks the parameters (ConfigError).
  DockingProcedure(const ProcedureParams& params, const ClockParams& clock,
                   const ApproachParams& approach = {});

  // Frames must increase. The result is valid until the next call.
  const Directive& Update(const PoseEstimate& estimate, const Outlook& outlook = {});
  // Whether a prediction at that frame would be made use of.
  bool WouldGoBlind(const PoseEstimate& estimate) const;

 private:
  void Find(const PoseEstimate& estimate, const Outlook& outlook);
  void SearchOn(int64_t frame, const Outlook& outlook);
  void SteerByNavigation(const AxesPose& wanted_HM);
  void Servo(const PoseEstimate& estimate);
  void Dock(int64_t frame, const AxesPose& marker);
  void Stay(const PoseEstimate& estimate);
  void Undock(const PoseEstimate& estimate);
  double RampedX_m() const;  // by which the desired x has been lowered or raised
  void BackOff(int64_t frame, const std::string& reason);  // from an attempt that failed
  // Without a usable estimate.
  void BridgeLoss(const PoseEstimate& estimate, const Outlook& outlook);
  void Enter(Stage stage, int64_t frame, std::string reason);
  AxisVolts SearchVolts(int64_t frame) const;
  bool HeldFor(double seconds) const;
  bool LostFor(double seconds) const;
  std::string LossReason(const PoseEstimate& estimate) const;

  ProcedureParams params_;
  ClockParams clock_;
  Approach approach_;
  Directive directive_;
  std::optional<int64_t> last_frame_;
  int64_t seen_frame_ = 0;    // when the marker was last seen; before the first frame if never
  int64_t stage_frame_ = 0;   // the first frame of the stage
  int64_t ramp_frames_ = 0;   // frames for which the desired x has been lowered or raised
  int64_t blind_frames_ = 0;  // likewise, by a prediction
  double nearest_x_m_ = 0;    // while docking: the smallest x
  int64_t nearest_frame_ = 0;
  int attempts_ = 0;  // times that docking has begun in this cycle
  int64_t held_ = 0;  // successive estimates that fulfil the condition to leave the stage
  bool was_found_ = false;
};

}  // namespace turbidock::control
