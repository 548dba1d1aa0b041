#pragma once
// What is kept of a trial: its log, a row a camera frame, in memory (files are made from it
// afterwards), and its record. Each part of the record is one line in TrialRecord::Fields:
// result.json, the columns of a batch's file, the pipe from a worker and `list result-keys` are
// made of that list. To add one, add a member and its line there, and compute it in recorder.cc.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "control/axes.h"
#include "control/docking_procedure.h"
#include "sim/base/axes_pose.h"
#include "sim/base/fields.h"
#include "sim/base/pose.h"
#include "sim/base/thruster_command.h"
#include "sim/vehicle/energy_balance.h"

namespace turbidock::trial {

// What is known of one camera frame. Time and truth are of the moment the vehicle acts; the
// estimate is of the image that arrived last, exposed camera_delay_frames before that. An estimate
// is compared with the truth of its image, whatever is steered with the truth of the frame.
struct FrameRecord {
  int64_t frame = 0;
  double time_s = 0;
  control::Stage stage = control::Stage::kApproach;
  Pose est_X_HM;        // the estimator's best pose
  double fitness = -1;  // and its F
  // Squared, by the covariance that the estimate claims (vision/normalised_error.h), if it does.
  std::optional<double> normalised_error2;
  double image_time_s = 0;  // when its image was exposed; 0 for what was exposed before the trial
  Pose true_at_image_X_HM;  // the marker then
  Pose true_X_HM;
  Pose true_X_WB;
  Twist true_V_WB_B;
  std::optional<AxesPose> navigated_MH;    // the camera head in M, where there is a navigation
  std::optional<AxesPose> uncorrected_MH;  // the same before the frame's estimate corrected it
  AxesPose desired;
  bool controlled = false;  // false: the vehicle searches or drifts instead of following `desired`
  control::Axes demand = control::Axes::Zero();  // of the controller; zero without control
  ThrusterCommand command;                       // a voltage for each thruster
  double insertion_depth_m = 0;                  // of the pole's tip past the dock's mouth
  bool inserted = false;                         // the tip is inside the straight hole
  double dock_force_newton = 0;                  // the largest until the next frame
  double collision_force_newton = 0;
};

struct TrialLog {
  std::vector<std::string> thrusters{"surge_left", "surge_right", "sway", "heave"};
  std::vector<FrameRecord> frames{};
};

// How a trial ended. The first two meet the published criterion on the estimate.
enum class Outcome {
  kSuccess,      // and the pole is in the hole
  kFalseDock,    // but the pole is not in the hole
  kTimeout,      // the time was up
  kMarkerLost,   // the marker was found once and then lost for too long
  kGaveUp,       // all attempts to dock failed
  kCollision,    // the vehicle touched something other than the inside of the dock
  kDiverged,     // the physics gave no usable state
  kInterrupted,  // the caller asked to stop
  // No end of its own: there is a reason, and nothing else is known.
  kCrashed,   // the trial's process ended
  kHung,      // the trial's process was stopped after its time limit
  kNoAnswer,  // a program that steers or sees for the vehicle did not answer
};
constexpr auto Names(Outcome) {
  using enum Outcome;
  return EnumList<Outcome>({{kSuccess, "success"},
                            {kFalseDock, "false_dock"},
                            {kTimeout, "timeout"},
                            {kMarkerLost, "marker_lost"},
                            {kGaveUp, "gave_up"},
                            {kCollision, "collision"},
                            {kDiverged, "diverged"},
                            {kInterrupted, "interrupted"},
                            {kCrashed, "crashed"},
                            {kHung, "hung"},
                            {kNoAnswer, "no_answer"}});
}
// Whether a trial that ended so came to an end of its own.
constexpr bool HasEnd(Outcome outcome) {
  return outcome != Outcome::kCrashed && outcome != Outcome::kHung && outcome != Outcome::kNoAnswer;
}

// Why a trial did not dock: one word a trial, for tables of many. A trial succeeds when its outcome
// is `success`: the criterion was met and the pole is in the hole. Otherwise the first of these
// that applies, in this order.
enum class Failure {
  kNone,
  kDiverged,    // the physics gave no usable state
  kCollision,   // the vehicle touched something other than the inside of the dock
  kJammed,      // the pole was held in the dock for a while
  kFalseLock,   // the estimate that was acted on was wrong, also before a collision: see FailureOf
  kNeverFound,  // the vehicle never began to servo
  kLostInServoing,  // the marker was lost to the end of the trial, last seen while servoing
  kLostInDocking,   // the same, while docking
  kOscillation,     // the vehicle swung when it was last under control: see FailureOf
  kGaveUp,          // none of these, and all attempts failed
  kTimeout,         // none of these, and the time was up
  kCrashed,         // the trial's process ended
  kHung,            // the trial's process was stopped after its time limit
  kNoAnswer,        // a program that steers or sees for the vehicle did not answer
};
constexpr auto Names(Failure) {
  using enum Failure;
  return EnumList<Failure>({{kNone, "none"},
                            {kDiverged, "diverged"},
                            {kCollision, "collision"},
                            {kJammed, "jammed"},
                            {kFalseLock, "false_lock"},
                            {kNeverFound, "never_found"},
                            {kLostInServoing, "lost_in_servoing"},
                            {kLostInDocking, "lost_in_docking"},
                            {kOscillation, "oscillation"},
                            {kGaveUp, "gave_up"},
                            {kTimeout, "timeout"},
                            {kCrashed, "crashed"},
                            {kHung, "hung"},
                            {kNoAnswer, "no_answer"}});
}

// Which column of a batch's file a field has, if any.
enum class Storage {
  kNowhere,
  kFact,    // text or a whole number
  kMetric,  // a number, nothing when what it measures did not happen
  kRun,     // differs from run to run: not in the view `results`
};

// Where a field is found.
struct FieldPolicy {
  Storage storage = Storage::kNowhere;
  // Its column's name, the same as its key if empty; of a group, {} stands for what is inside it.
  const char* column = "";
  bool json = true;  // in result.json

  constexpr FieldPolicy As(const char* name) const { return {storage, name, json}; }
  constexpr FieldPolicy StoredOnly() const { return {storage, column, false}; }
};
inline constexpr FieldPolicy kReport{};  // in result.json only
inline constexpr FieldPolicy kFact{Storage::kFact}, kMetric{Storage::kMetric}, kRun{Storage::kRun};

// Of the pole with the dock.
struct Contact {
  double time_s = 0;
  double force_newton = 0;

  bool operator==(const Contact&) const = default;

  static void Fields(auto& self, auto&& field) {
    field("time_s", self.time_s, Finite(), "time");
    field("force_newton", self.force_newton, Finite(), "force");
  }
};

// A setting that somebody changed while the trial ran, from this frame on.
struct Change {
  int64_t frame = 0;
  double time_s = 0;
  std::string key;    // of the scenario; "push" for a force on the vehicle
  std::string value;  // as YAML; of a push [x, y, z] in N, in W

  bool operator==(const Change&) const = default;

  static void Fields(auto& self, auto&& field) {
    field("frame", self.frame, Finite(), "first frame with the changed setting");
    field("time_s", self.time_s, Finite(), "time from which the changed setting holds");
    field("key", self.key, Finite(), "key of the changed setting in the scenario, or push");
    field(
        "value", self.value, Finite(),
        "value of the changed setting, as YAML; of a push [x, y, z] in N, in the world's frame W");
  }
};

// Members have the fields' meaning, which Fields says. Of a trial that comes from a worker or a
// file, members without a column have their defaults.
struct TrialRecord {
  Outcome outcome = Outcome::kTimeout;
  Failure failure = Failure::kNone;
  std::string reason;
  bool docked = false, inserted = false;
  double time_s = 0;
  AxesPose start, final_error_true, final_error_estimated;
  std::string estimator;
  double fitness_mean = 0, fitness_best = -1;
  double false_confidence_s = 0;
  std::optional<double> normalised_error2_mean;
  std::optional<double> first_sight_m, handover_time_s;
  std::optional<double> handover_navigation_error_m, handover_navigation_error_rad;
  int searches = 0, attempts = 0, dockings = 0, returns_to_servoing = 0;
  int64_t repeated_images = 0;
  double tracking_rms_m = 0, overshoot_m = 0, effort_v = 0;
  double insertion_depth_m = 0;
  std::optional<double> insertion_time_s;
  std::optional<Contact> first_dock_contact;
  double dock_force_max_newton = 0;
  std::optional<double> jam_time_s;
  vehicle::EnergyBalance energy;
  std::map<control::Stage, double> stage_time_s;
  std::vector<control::Transition> transitions;
  std::vector<Change> changes;
  int64_t seed = 0;
  std::string version, renderer;
  std::string digest;
  double wall_time_s = 0, real_time_factor = 0, peak_memory_mib = 0;
  double cpu_time_s = 0;
  int64_t rss_bytes = 0;
  std::string printed;

  bool ended() const { return HasEnd(outcome); }
  // Whether it says if the vehicle docks.
  bool judged() const { return outcome != Outcome::kNoAnswer; }
  bool success() const { return failure == Failure::kNone; }
  bool operator==(const TrialRecord&) const = default;

  static void Fields(auto& self, auto&& field) {
    SightFields(self, field);
    MotionFields(self, field);
    RunFields(self, field);
  }

 private:
  // How it ended, and what was seen.
  static void SightFields(auto& self, auto&& field) {
    field("outcome", self.outcome, kFact, "outcome: how the trial ended");
    field("failure", self.failure, kFact.StoredOnly(),
          "failure: why the trial did not dock; none if it did");
    field("reason", self.reason, kFact, "reason of the outcome, as a sentence");
    field("docked", self.docked, kFact, "whether the docking criterion was met on the estimate");
    field("inserted", self.inserted, kFact,
          "whether the pole's tip truly is inside the straight hole at the end");
    field(
        "time_s", self.time_s, kMetric,
        "simulated time at which the docking criterion was met for the last time, else of the end");
    field("start", self.start, kMetric.As("start_{}").StoredOnly(),
          "start: camera head in the marker's frame M when the trial begins");
    field("final_error_true", self.final_error_true, kMetric.As("final_error_true_{}"),
          "true error at time_s: marker in the camera head less the desired pose");
    field("final_error_estimated", self.final_error_estimated,
          kMetric.As("final_error_estimated_{}"),
          "estimated error at time_s, of an image cameras.delay_frames older: marker in the camera "
          "head less the desired pose");
    field("estimator", self.estimator, kReport,
          "estimator that made the estimates, by name, or true_pose");
    field("fitness_mean", self.fitness_mean, kMetric, "mean fitness F over all frames");
    field("fitness_best", self.fitness_best, kMetric, "largest fitness F of all frames");
    field("false_confidence_s", self.false_confidence_s, kMetric,
          "time in which the true error of a detected estimate, at its image, exceeded the "
          "estimate's own 3-sigma bound (99.73 %)");
    field("normalised_error2_mean", self.normalised_error2_mean, kMetric,
          "mean squared error of detected estimates over the covariance that they claim: 6 if it "
          "is right");
    field("first_sight_m", self.first_sight_m, kMetric,
          "true distance of the marker at the first image whose fitness F reached found_fitness");
    field("handover_time_s", self.handover_time_s, kMetric, "time at which servoing first began");
    field("handover_navigation_error_m", self.handover_navigation_error_m, kMetric,
          "error of navigation's position of the camera head when servoing first began, before "
          "vision corrected it");
    field("handover_navigation_error_rad", self.handover_navigation_error_rad, kMetric,
          "error of navigation's heading when servoing first began, before vision corrected it, "
          "positive to the left");
  }
  // What it did.
  static void MotionFields(auto& self, auto&& field) {
    field(
        "searches", self.searches, kMetric,
        "number of times that the stage search began: the marker was not found where it should be");
    field("attempts", self.attempts, kMetric, "number of times that the stage docking began");
    field("dockings", self.dockings, kMetric,
          "number of times that the docking criterion was met; more than one where the vehicle "
          "undocks and docks again");
    field("returns_to_servoing", self.returns_to_servoing, kMetric,
          "number of times that the vehicle went back from docking to servoing");
    field(
        "repeated_images", self.repeated_images, kReport,
        "number of images that were their camera's last one again, byte for byte: taken for black");
    field("tracking_rms_m", self.tracking_rms_m, kMetric,
          "root mean square of the true y and z errors together, each at most 1 m, after the "
          "approach; of all frames if that never ended");
    field("overshoot_m", self.overshoot_m, kMetric,
          "largest way beyond the desired x after the approach, at most 1 m; of all frames if that "
          "never ended");
    field("effort_v", self.effort_v, kMetric,
          "root mean square of the commands' deviations from neutral voltage");
    field("insertion_depth_m", self.insertion_depth_m, kMetric,
          "depth of the pole's tip past the dock's mouth at the end");
    field("insertion_time_s", self.insertion_time_s, kMetric,
          "time at which the pole first was in the hole");
    field("first_dock_contact", self.first_dock_contact, kMetric.As("dock_contact_{}"),
          "first contact of the pole with the dock");
    field("dock_force_max_newton", self.dock_force_max_newton, kMetric,
          "largest force between pole and dock");
    field("jammed", self.jam_time_s.has_value(), kReport,
          "whether the pole was held in the dock; no end of the trial");
    field("jam_time_s", self.jam_time_s, kMetric, "time at which the pole first was found jammed");
    field("energy", self.energy, kReport, "energy of the vehicle over the whole trial");
    field("thruster_work_joule", self.energy.thruster_work, kMetric.StoredOnly(),
          "energy of the vehicle over the whole trial, work done by the thrusters");
    field("stage_time_s", self.stage_time_s, kMetric.As("{}_time_s"), "time spent in the stage");
    field("transitions", self.transitions, kReport, "changes of stage: frame, from, to, reason");
    field("changes", self.changes, kReport,
          "settings that somebody changed while the trial ran: frame, time_s, key, value");
  }
  // What it was run with and took.
  static void RunFields(auto& self, auto&& field) {
    field("seed", self.seed, kFact, "seed of the scenario");
    field("version", self.version, kReport, "version of the program, with its commit");
    field("renderer", self.renderer, kRun,
          "renderer: GL context and what draws in it; empty where nothing is drawn");
    field("digest", self.digest, kFact,
          "digest of states, estimates and commands: equal for equal runs; empty without an end");
    field("wall_time_s", self.wall_time_s, kRun,
          "wall time of the trial; in a batch's file of its job");
    field("real_time_factor", self.real_time_factor, kReport,
          "ratio of simulated time to wall time");
    field("peak_memory_mib", self.peak_memory_mib, kReport,
          "largest resident memory of the process until the trial's end");
    field("cpu_time_s", self.cpu_time_s, kRun.StoredOnly(),
          "processor time of the worker in this job");
    field("rss_bytes", self.rss_bytes, kRun.StoredOnly(),
          "resident memory of the worker after the job");
    field("log", self.printed, kRun.StoredOnly(),
          "last lines printed by a trial without an end of its own");
  }
};

}  // namespace turbidock::trial
