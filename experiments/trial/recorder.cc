#include "experiments/trial/recorder.h"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "vision/normalised_error.h"

namespace turbidock::trial {
namespace {

using control::Stage;

// Twenty minutes of frames; a longer log grows as it goes.
constexpr int64_t kReservedFrames = 36000;

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

}  // namespace

void DockContact::Update(const FrameRecord& frame) {
  if (!first_contact_ && frame.dock_force_newton > 0)
    first_contact_ = Contact{frame.time_s, frame.dock_force_newton};
  if (!insertion_time_s_ && frame.inserted) insertion_time_s_ = frame.time_s;
  force_max_newton_ = std::max(force_max_newton_, frame.dock_force_newton);

  if (frame.inserted || frame.dock_force_newton <= jam_.force_newton) {
    held_since_s_.reset();
    return;
  }
  // Progress begins the wait anew, from where it has got to.
  if (!held_since_s_ || std::abs(frame.insertion_depth_m - held_depth_m_) >= jam_.progress_m) {
    held_since_s_ = frame.time_s;
    held_depth_m_ = frame.insertion_depth_m;
  }
  // Frame times are sums of fractions: forgive their rounding.
  if (!jam_time_s_ && frame.time_s - *held_since_s_ >= jam_.time_s - 1e-9)
    jam_time_s_ = frame.time_s;
}

TrialRecorder::TrialRecorder(const Scenario& scenario)
    : scenario_(scenario), dock_contact_(scenario.jam) {
  const ClockParams& clock = scenario.clock;
  const int64_t most_frames =
      clock.FramesFor(scenario.duration_s) + clock.FramesFor(scenario.after_docked_s);
  result_.log.frames.reserve(static_cast<size_t>(std::min(most_frames, kReservedFrames)));
  result_.seed = scenario.seed;
}

void TrialRecorder::Add(const Change& change) {
  digest_.Add(change.frame);
  digest_.Add(change.key);
  digest_.Add(change.value);
  result_.changes.push_back(change);
}

void TrialRecorder::Add(const FrameRecord& record) {
  if (record.stage == Stage::kUndocking) docked_frame_.reset();
  if (record.stage == Stage::kDocked && !docked_frame_) docked_frame_ = record.frame;
  if (!docked_frame_ || docked_frame_ == record.frame) {
    result_.time_s = record.time_s;
    result_.final_error_true = AxesPose::Of(record.true_X_HM) - record.desired;
    result_.final_error_estimated = AxesPose::Of(record.est_X_HM) - record.desired;
  }
  NoteHandover(record);
  dock_contact_.Update(record);
  AddToDigest(record, &digest_);
  result_.log.frames.push_back(record);
}

// From navigation to vision, the first time.
void TrialRecorder::NoteHandover(const FrameRecord& record) {
  if (!result_.first_sight_m && record.fitness >= scenario_.procedure.found_fitness)
    result_.first_sight_m = record.true_at_image_X_HM.p.norm();
  if (result_.handover_time_s || control::IsBeforeFound(record.stage)) return;
  result_.handover_time_s = record.time_s;
  if (!record.uncorrected_MH) return;
  const AxesPose error = *record.uncorrected_MH - AxesPose::Of(record.true_X_HM.Inverse());
  result_.handover_navigation_error_m = error.distance_m();
  result_.handover_navigation_error_rad = error.yaw_rad;
}

// How well and how hard it was steered.
void TrialRecorder::SummariseControl() {
  const std::vector<FrameRecord>& frames = result_.log.frames;
  const bool found = std::any_of(frames.begin(), frames.end(), [](const FrameRecord& record) {
    return !control::IsBeforeFound(record.stage);
  });
  double squares = 0, volts_squared = 0;
  int64_t counted = 0, commands = 0;
  for (const FrameRecord& record : frames) {
    for (const double volts : record.command.volts)
      volts_squared += (volts - kNeutralVolts) * (volts - kNeutralVolts);
    commands += std::ssize(record.command.volts);
    if (found && control::IsBeforeFound(record.stage)) continue;
    const AxesPose e = AxesPose::Of(record.true_X_HM) - record.desired;
    squares += std::min(1.0, e.y_m * e.y_m) + std::min(1.0, e.z_m * e.z_m);
    result_.overshoot_m = std::clamp(-e.x_m, result_.overshoot_m, 1.0);
    ++counted;
  }
  result_.tracking_rms_m = std::sqrt(squares / static_cast<double>(counted));
  result_.effort_v = std::sqrt(volts_squared / static_cast<double>(commands));
}

// Sums over the frames.
void TrialRecorder::Summarise() {
  double sum = 0, error2 = 0;
  int64_t claims = 0, false_claims = 0;
  std::map<Stage, int64_t> frames;
  for (const FrameRecord& record : result_.log.frames) {
    sum += record.fitness;
    result_.fitness_best = std::max(result_.fitness_best, record.fitness);
    ++frames[record.stage];
    if (!record.normalised_error2) continue;
    error2 += *record.normalised_error2;
    ++claims;
    false_claims += *record.normalised_error2 > vision::kThreeSigma2;
  }
  result_.false_confidence_s = scenario_.clock.TimeOfFrame(false_claims);
  if (claims > 0) result_.normalised_error2_mean = error2 / static_cast<double>(claims);
  for (const auto& [stage, count] : frames)
    result_.stage_time_s[stage] = scenario_.clock.TimeOfFrame(count);
  SummariseControl();
  result_.fitness_mean = sum / static_cast<double>(result_.log.frames.size());
  for (const control::Transition& change : result_.transitions) {
    result_.searches += change.to == Stage::kSearch;
    result_.attempts += change.to == Stage::kDocking;
    result_.dockings += change.to == Stage::kDocked;
    result_.returns_to_servoing +=
        change.from == Stage::kDocking && change.to == Stage::kVisualServoing;
  }
}

TrialResult TrialRecorder::Finish(const vehicle::Plant& plant, const control::Directive& directive,
                                  const Ending& ending) {
  const vehicle::PoleInDock pole = plant.pole();
  const vehicle::VehicleTruth truth = plant.truth();
  const double end_s = scenario_.clock.TimeOfFrame(std::ssize(result_.log.frames));
  digest_.Add(truth.X_WB);
  digest_.Add(truth.V_WB_B.w);
  digest_.Add(truth.V_WB_B.v);
  FrameRecord end;
  end.time_s = end_s;
  end.insertion_depth_m = pole.insertion_depth_m;
  end.inserted = pole.inserted;
  dock_contact_.Update(end);
  result_.docked = docked_frame_.has_value() && directive.done;
  if (!result_.docked) result_.time_s = end_s;
  result_.inserted = pole.inserted;
  result_.insertion_depth_m = pole.insertion_depth_m;
  result_.insertion_time_s = dock_contact_.insertion_time_s();
  result_.first_dock_contact = dock_contact_.first_contact();
  result_.dock_force_max_newton = dock_contact_.force_max_newton();
  result_.jam_time_s = dock_contact_.jam_time_s();
  result_.energy = plant.energy();
  Summarise();
  result_.reason = ReasonOf(ending, scenario_, result_, directive);
  result_.outcome = ending.outcome == Outcome::kSuccess && !result_.inserted ? Outcome::kFalseDock
                                                                             : ending.outcome;
  result_.failure = FailureOf(scenario_, result_);
  result_.digest = digest_.Hex();
  result_.wall_time_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start_).count();
  result_.peak_memory_mib = PeakMemoryMib();
  result_.real_time_factor = end_s / result_.wall_time_s;
  return std::move(result_);
}

}  // namespace turbidock::trial
