#include "experiments/trial/trial.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "control/autopilot.h"
#include "experiments/trial/world.h"
#include "sim/base/digest.h"
#include "sim/base/random.h"
#include "sim/base/units.h"

namespace turbidock::trial {
namespace {

using control::Stage;

// Twenty minutes of frames; a longer log grows as it goes.
constexpr int64_t kReservedFrames = 36000;

PoseError ErrorOf(const Pose& X_HM, const control::DesiredPose& desired) {
  return {X_HM.p.x() - desired.x_m, X_HM.p.y() - desired.y_m, X_HM.p.z() - desired.z_m,
          WrapAngle(YawOf(X_HM.q) - desired.yaw_rad)};
}

double PeakMemoryMib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;  // Linux counts KiB
}

void AddToDigest(const FrameRecord& record, Digest* digest) {
  digest->Add(record.frame);
  digest->Add(record.true_X_WB);
  digest->Add(record.true_V_WB_B.w);
  digest->Add(record.true_V_WB_B.v);
  digest->Add(record.est_X_HM);
  digest->Add(record.fitness);
  for (const double volts : record.command.volts) digest->Add(volts);
}

// What a jam adds to a reason.
std::string JamRemark(const TrialResult& result) {
  return result.jam_time_s
             ? fmt::format("; the pole jammed in the dock at {:.1f} s", *result.jam_time_s)
             : "";
}

// Why the time was up: what the vehicle was still missing.
std::string TimeoutReason(const Scenario& scenario, const TrialResult& result,
                          const control::Directive& directive) {
  const std::string after = fmt::format("{:g} s are over", scenario.duration_s);
  if (directive.stage == Stage::kApproach && result.log.transitions.empty())
    return fmt::format(
        "{} and the marker was never found: the best fitness was {:.2f}, it takes "
        "{:g} for {:g} s",
        after, result.fitness_best, scenario.procedure.found_fitness,
        scenario.procedure.found_hold_s);
  const PoseError& e = result.final_error_estimated;
  return fmt::format(
             "{} in {} with the marker estimated {:.0f} mm, {:.0f} mm, {:.0f} mm and {:.1f} deg "
             "from the desired pose",
             after, NameOf(directive.stage), units::MmFromM(e.x_m), units::MmFromM(e.y_m),
             units::MmFromM(e.z_m), units::DegFromRad(e.yaw_rad)) +
         JamRemark(result);
}

std::string DockedReason(const TrialResult& result) {
  const std::string met =
      fmt::format("the docking criterion was met after {:.1f} s", result.time_s);
  if (result.inserted)
    return fmt::format("{} and the pole is in the hole, {:.0f} mm past the mouth", met,
                       units::MmFromM(result.insertion_depth_m));
  return fmt::format(
      "{} on the estimate, but the pole is not in the hole: its tip is {:.0f} mm {} "
      "the mouth and the true position of the marker is off by {:.0f} mm in y and "
      "{:.0f} mm in z",
      met, units::MmFromM(std::abs(result.insertion_depth_m)),
      result.insertion_depth_m < 0 ? "in front of" : "past",
      units::MmFromM(result.final_error_true.y_m), units::MmFromM(result.final_error_true.z_m));
}

// How well and how hard it was steered.
void SummariseControl(TrialResult* result) {
  const std::vector<FrameRecord>& frames = result->log.frames;
  const bool found = std::any_of(frames.begin(), frames.end(), [](const FrameRecord& record) {
    return record.stage != Stage::kApproach;
  });
  double squares = 0, volts_squared = 0;
  int64_t counted = 0;
  for (const FrameRecord& record : frames) {
    for (const double volts : record.command.volts)
      volts_squared += (volts - kNeutralVolts) * (volts - kNeutralVolts);
    if (found && record.stage == Stage::kApproach) continue;
    const PoseError e = ErrorOf(record.true_X_HM, record.desired);
    squares += std::min(1.0, e.y_m * e.y_m) + std::min(1.0, e.z_m * e.z_m);
    result->overshoot_m = std::clamp(-e.x_m, result->overshoot_m, 1.0);
    ++counted;
  }
  result->tracking_rms_m = std::sqrt(squares / static_cast<double>(counted));
  result->effort_v = std::sqrt(volts_squared / static_cast<double>(kThrusterCount * frames.size()));
}

// Sums over the frames.
void Summarise(const Scenario& scenario, TrialResult* result) {
  double sum = 0;
  std::map<Stage, int64_t> frames;
  for (const FrameRecord& record : result->log.frames) {
    sum += record.fitness;
    result->fitness_best = std::max(result->fitness_best, record.fitness);
    ++frames[record.stage];
  }
  for (const auto& [stage, count] : frames)
    result->stage_time_s[stage] = scenario.clock.TimeOfFrame(count);
  SummariseControl(result);
  result->fitness_mean = sum / static_cast<double>(result->log.frames.size());
  for (const control::Transition& change : result->log.transitions)
    result->returns_to_servoing +=
        change.from == Stage::kDocking && change.to == Stage::kVisualServoing;
}

FrameRecord RecordOf(const Scenario& scenario, int64_t frame, const World& world,
                           const PoseEstimate& estimate, const control::Autopilot& autopilot,
                           const ThrusterCommand& command) {
  const vehicle::VehicleTruth truth = world.plant().truth();
  const control::Directive& directive = autopilot.directive();
  return {.frame = frame,
          .time_s = scenario.clock.TimeOfFrame(frame),
          .stage = directive.stage,
          .est_X_HM = estimate.X_HM,
          .fitness = estimate.fitness,
          .true_X_HM = world.true_X_HM(),
          .true_X_WB = truth.X_WB,
          .true_V_WB_B = truth.V_WB_B,
          .desired = directive.desired,
          .controlled = directive.control,
          .demand = autopilot.demand(),
          .command = command,
          .insertion_depth_m = world.plant().pole().insertion_depth_m};
}

}  // namespace

Pose DrawStart(const Scenario& scenario) {
  Rng rng = SeedTree(static_cast<uint64_t>(scenario.seed)).Stream("start");
  const StartParams& s = scenario.start;
  const double distance_m = rng.Uniform(s.distance_min_m, s.distance_max_m);
  const double y_m = rng.Uniform(-s.lateral_m, s.lateral_m);
  const double z_m = rng.Uniform(-s.vertical_m, s.vertical_m);
  const double yaw_rad = rng.Uniform(-s.heading_rad, s.heading_rad);
  return {FromYawPitchRoll(yaw_rad, 0, 0), {-distance_m, y_m, z_m}};
}

TrialResult RunTrial(const Scenario& scenario, const TrialOptions& options) {
  const auto wall_start = std::chrono::steady_clock::now();
  CheckFields(scenario, "");
  const ClockParams& clock = scenario.clock;
  World world(scenario, options.spectator, options.timer);
  if (options.on_remark && !world.remark().empty()) options.on_remark(world.remark());
  Eyes eyes(scenario, options.whole_images || !scenario.region_of_interest, options.timer, &world);
  control::Autopilot autopilot(scenario.control, scenario.procedure, scenario.image_clock());
  DockContact dock_contact(scenario.jam);

  TrialResult result;
  result.estimator = eyes.name();
  result.seed = scenario.seed;
  result.renderer = world.renderer();
  Digest digest;
  const int64_t last_frame = clock.FramesFor(scenario.duration_s);
  const int64_t hold_frames = clock.FramesFor(scenario.docked_hold_s);
  result.log.frames.reserve(
      static_cast<size_t>(std::min(last_frame + hold_frames, kReservedFrames)));
  std::optional<int64_t> docked_frame;
  std::optional<Outcome> end;
  if (options.timer) options.timer->Skip();

  ThrusterCommand command;
  int64_t frame = 0;
  for (; !end; ++frame) {
    const TrialExcitation excitation = options.excite ? options.excite(frame) : TrialExcitation();
    const bool arrives = eyes.Update(frame);
    if (arrives) {
      command = autopilot.Update(eyes.estimate(), excitation.control);
      Lap(options.timer, LoopStage::kControl);
    }
    world.Push(excitation.F_B_B);
    const control::Directive& directive = autopilot.directive();
    FrameRecord record =
        RecordOf(scenario, frame, world, eyes.estimate(), autopilot, command);
    if (arrives && directive.transition) {
      control::Transition change = *directive.transition;
      change.frame = frame;  // when the vehicle acts, not when the image was exposed
      result.log.transitions.push_back(change);
      if (options.on_transition) options.on_transition(change);
    }
    if (directive.stage == Stage::kDocked && !docked_frame) docked_frame = frame;
    if (!docked_frame || docked_frame == frame) {
      result.time_s = record.time_s;
      result.final_error_true = ErrorOf(record.true_X_HM, directive.desired);
      result.final_error_estimated = ErrorOf(record.est_X_HM, directive.desired);
    }
    const Image3u8* spectator = world.DrawSpectator();
    const bool inserted = world.plant().pole().inserted;
    Lap(options.timer, LoopStage::kLog);

    vehicle::ContactReport contacts;
    const std::optional<std::string> fault = world.Advance(command, &contacts);
    record.dock_force_newton = contacts.dock_force_newton;
    record.collision_force_newton = contacts.collision_force_newton;
    dock_contact.Update({.time_s = record.time_s,
                         .insertion_depth_m = record.insertion_depth_m,
                         .inserted = inserted,
                         .dock_force_newton = contacts.dock_force_newton});
    AddToDigest(record, &digest);
    result.log.frames.push_back(record);
    Lap(options.timer, LoopStage::kLog);
    if (options.observe)
      options.observe({record, eyes.seen(), arrives ? eyes.estimate().evaluations : 0, spectator});
    if (options.timer) options.timer->Skip();

    const double now_s = clock.TimeOfFrame(frame + 1);
    if (fault) {
      end = Outcome::kDiverged;
      result.reason = *fault;
    } else if (contacts.collision_force_newton > 0) {
      end = Outcome::kCollision;
      result.reason = fmt::format("{} at {:.1f} s with {:.1f} N", contacts.collision, now_s,
                                  contacts.collision_force_newton);
    } else if (directive.given_up) {
      end = Outcome::kMarkerLost;
      result.reason = directive.given_up_reason;
    } else if (options.stop_requested && options.stop_requested()) {
      end = Outcome::kInterrupted;
      result.reason = fmt::format("stopped at {:.1f} s", now_s);
    } else if (docked_frame) {
      if (frame + 1 - *docked_frame >= hold_frames) end = Outcome::kDocked;
    } else if (frame + 1 >= last_frame) {
      end = Outcome::kTimeout;
    }
  }

  const vehicle::PoleInDock pole = world.plant().pole();
  const vehicle::VehicleTruth truth = world.plant().truth();
  digest.Add(truth.X_WB);
  digest.Add(truth.V_WB_B.w);
  digest.Add(truth.V_WB_B.v);
  dock_contact.Update({.time_s = clock.TimeOfFrame(frame),
                       .insertion_depth_m = pole.insertion_depth_m,
                       .inserted = pole.inserted});
  result.docked = docked_frame.has_value();
  if (!result.docked) result.time_s = clock.TimeOfFrame(frame);
  result.inserted = pole.inserted;
  result.insertion_depth_m = pole.insertion_depth_m;
  result.insertion_time_s = dock_contact.insertion_time_s();
  result.first_dock_contact = dock_contact.first_contact();
  result.dock_force_max_newton = dock_contact.force_max_newton();
  result.jam_time_s = dock_contact.jam_time_s();
  result.energy = world.plant().energy();
  Summarise(scenario, &result);
  if (end == Outcome::kDocked) {
    if (!result.inserted) end = Outcome::kFalseDock;
    result.reason = DockedReason(result);
  }
  if (end == Outcome::kTimeout)
    result.reason = TimeoutReason(scenario, result, autopilot.directive());
  result.outcome = *end;
  result.digest = digest.Hex();
  result.wall_time_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count();
  result.peak_memory_mib = PeakMemoryMib();
  result.real_time_factor = clock.TimeOfFrame(frame) / result.wall_time_s;
  return result;
}

}  // namespace turbidock::trial
