#include "experiments/studies/gate/envelope_gate.h"

#include <algorithm>
#include <cmath>

namespace turbidock::gate {
namespace {

constexpr double kLargestShift = 30;  // of log odds: nothing or everything succeeds

// Why it failed, as far as its end alone tells.
trial::Failure FailureOf(trial::Outcome outcome) {
  if (outcome == trial::Outcome::kSuccess) return trial::Failure::kNone;
  for (const auto& [failure, name] : EnumNames<trial::Failure>::kNames)
    if (name == NameOf(outcome)) return failure;
  return outcome == trial::Outcome::kFalseDock ? trial::Failure::kFalseLock
                                               : trial::Failure::kLostInServoing;
}

std::vector<const batch::StoredTrial*> Pointers(const std::vector<batch::StoredTrial>& trials) {
  std::vector<const batch::StoredTrial*> all(trials.size());
  std::ranges::transform(trials, all.begin(), [](const auto& trial) { return &trial; });
  return all;
}

// The shift after which so much is left of what falls with it.
double ShiftTo(double left, const auto& after) {
  double low = -kLargestShift, high = kLargestShift;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (after(middle) > left ? low : high) = middle;
  }
  return high;
}

}  // namespace

std::vector<batch::StoredTrial> TrialsIn(const BaselineCondition& baseline,
                                         const batch::Plan& plan) {
  std::vector<batch::StoredTrial> trials;
  for (const batch::ComparedTrial& trial : baseline.outcomes) {
    const batch::TrialSpec spec = plan.Trial(trial.trial);
    batch::StoredTrial& stored = trials.emplace_back();
    stored.trial = spec.trial;
    stored.cell = spec.cell;
    stored.sample = spec.sample;
    stored.parameters = spec.parameters;
    stored.record.seed = trial.seed;
    stored.record.outcome = trial.outcome;
    stored.record.failure = FailureOf(trial.outcome);
  }
  return trials;
}

EnvelopeShift::EnvelopeShift(const batch::Plan& plan, const BaselineCondition& baseline)
    : log_odds_(std::log(plan.envelope()->find.rate / (1 - plan.envelope()->find.rate))),
      tallies_(static_cast<size_t>(plan.envelope()->points())),
      count_(std::ssize(baseline.outcomes)) {
  for (const batch::ComparedTrial& trial : baseline.outcomes) {
    search::Tally& tally =
        tallies_[static_cast<size_t>(plan.Trial(trial.trial).cell) % tallies_.size()];
    ++tally.trials;
    tally.successes += trial.success();
  }
  boundary_ = search::BoundaryOf(plan.envelope()->Search(), tallies_);
}

double EnvelopeShift::AreaAfter(double shift) const {
  int64_t above = 0, all = 0;
  for (const auto& draw : boundary_.draws) {
    for (const float odds : draw) above += odds >= shift;
    all += std::ssize(draw);
  }
  return static_cast<double>(above) / static_cast<double>(all);
}

double EnvelopeShift::SuccessAfter(double shift) const {
  double successes = 0;
  for (const auto& draw : boundary_.draws)
    for (size_t i = 0; i < draw.size(); ++i)
      if (tallies_[i].trials > 0)
        successes += static_cast<double>(tallies_[i].trials) /
                     (1 + std::exp(shift - log_odds_ - static_cast<double>(draw[i])));
  return successes / static_cast<double>(count_ * std::ssize(boundary_.draws));
}

double EnvelopeShift::SuccessLost(double area_lost) const {
  const double shift =
      ShiftTo(area() - area_lost, [this](double value) { return AreaAfter(value); });
  return SuccessAfter(0) - SuccessAfter(shift);
}

double EnvelopeShift::AreaLost(double success_lost) const {
  const double shift =
      ShiftTo(SuccessAfter(0) - success_lost, [this](double value) { return SuccessAfter(value); });
  return area() - AreaAfter(shift);
}

batch::Change AreaChange(const EnvelopeShift& shift, const batch::Change& success) {
  batch::Change area;
  area.group = success.group;
  area.measure = batch::kArea;
  area.pairs = success.pairs;
  area.worse = success.worse;
  area.better = success.better;
  area.p_value = success.p_value;
  if (!success.difference) return area;
  area.difference = -shift.AreaLost(-*success.difference);
  area.a = shift.area();
  area.b = *area.a + *area.difference;
  if (success.interval_95)
    area.interval_95 = {-shift.AreaLost(-success.interval_95->low),
                        -shift.AreaLost(-success.interval_95->high)};
  return area;
}

batch::EnvelopeSummary BoundariesOf(const batch::Plan& plan,
                                    const std::vector<batch::StoredTrial>& before,
                                    const std::vector<batch::StoredTrial>& now) {
  const batch::EnvelopePlan& ranges = *plan.envelope();
  return {.plan = ranges,
          .envelopes = {EnvelopeOf(ranges, "baseline", Pointers(before)),
                        EnvelopeOf(ranges, "now", Pointers(now))}};
}

}  // namespace turbidock::gate
