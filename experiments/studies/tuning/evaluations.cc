#include "experiments/studies/tuning/evaluations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "experiments/system/build_info.h"
#include "sim/base/fields.h"

namespace turbidock::tuning {
namespace {

constexpr const char* kPhaseKey = "phase";

// An evaluation whose trials are under way. Its records are those up to the next look.
struct Running {
  Evaluation evaluation;
  size_t asked = 0, done = 0;
  bool ended = false;
};

batch::StoreHeader HeaderOf(const Study& study) {
  batch::StoreHeader header{.kind = "tune",
                            .plan = study.resolved(),
                            .build = system::BuildId(),
                            .shard = {},
                            .trials = 0,
                            .keys = {kPhaseKey}};
  for (const GainRange& gain : study.settings().gains) header.keys.push_back(gain.key);
  return header;
}

// The trials of a plan in the order in which they are run: cell by cell in turn, so that any
// beginning of them is fair.
std::vector<int64_t> FairOrder(const batch::Plan& plan) {
  std::vector<int64_t> order(static_cast<size_t>(plan.trials()));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int64_t trial) { return plan.Trial(trial).sample; });
  return order;
}

}  // namespace

double Evaluation::success_rate() const {
  if (records.empty()) return 0;
  const auto successes = std::ranges::count_if(records, &trial::TrialRecord::success);
  return static_cast<double>(successes) / static_cast<double>(records.size());
}

Evaluations::Evaluations(const Study& study, const std::string& file,
                         const batch::RunOptions& options)
    : study_(study),
      file_(file),
      store_(batch::ResultStore::Write(file, HeaderOf(study))),
      runner_(options, &store_) {}

std::vector<Evaluation> Evaluations::Run(const std::string& phase, const batch::Plan& plan,
                                         const std::vector<Gains>& candidates, bool cameras,
                                         const GoOn& go_on) {
  const std::vector<int64_t> order = FairOrder(plan);
  const RacingParams& racing = study_.settings().racing;
  const auto first = go_on ? static_cast<size_t>(racing.first) : order.size();
  // All trials of a candidate have a number, also those that racing leaves out.
  const int64_t first_evaluation = evaluations_, first_number = numbers_, of_each = plan.trials();
  numbers_ += of_each * std::ssize(candidates);
  std::vector<Running> running;
  for (const Gains& gains : candidates) {
    running.push_back({.evaluation = {evaluations_++, gains}});
    running.back().evaluation.records.resize(std::min(first, order.size()));
  }
  const auto running_of = [&](int64_t evaluation) -> Running& {
    return running[static_cast<size_t>(evaluation - first_evaluation)];
  };
  // The next trial of the first candidate that has one to ask for.
  const auto next = [&]() -> std::optional<int64_t> {
    for (Running& r : running)
      if (r.asked < r.evaluation.records.size() && !r.ended)
        return first_number + (r.evaluation.number - first_evaluation) * of_each +
               static_cast<int64_t>(r.asked++);
    return std::nullopt;
  };
  // A look decides by the trials before it only, whatever else is known: the same whenever it is
  // taken.
  const auto add = [&](const batch::StoredTrial& trial) {
    if (!std::isfinite(trial.record.time_s))
      throw ConfigError(file_ + fmt::format(": is damaged (trial {} has no time)", trial.trial));
    Running& r = running_of(trial.cell);
    std::vector<trial::TrialRecord>& records = r.evaluation.records;
    records[static_cast<size_t>(trial.sample)] = trial.record;
    ++trials_;
    if (++r.done < records.size()) return;
    if (records.size() == order.size() || !go_on(r.evaluation)) {
      r.evaluation.given_up = records.size() < order.size();
      r.ended = true;
    } else {
      records.resize(std::min(records.size() + static_cast<size_t>(racing.every), order.size()));
    }
  };
  const auto spec = [&](int64_t trial) {
    batch::TrialSpec of;
    of.trial = trial;
    of.cell = first_evaluation + (trial - first_number) / of_each;
    of.sample = (trial - first_number) % of_each;
    of.seed = plan.Trial(order[static_cast<size_t>(of.sample)]).seed;
    of.parameters = {{kPhaseKey, phase}};
    const Gains& gains = running_of(of.cell).evaluation.gains;
    for (size_t i = 0; i < gains.size(); ++i)
      of.parameters.push_back({study_.settings().gains[i].key, FormatNumber(gains[i])});
    return of;
  };
  const auto scenario = [&](const batch::TrialSpec& of) {
    trial::Scenario changed = study_.ScenarioOf(plan, order[static_cast<size_t>(of.sample)],
                                                running_of(of.cell).evaluation.gains);
    if (cameras) changed.pose_source = trial::PoseSource::kCameras;
    return changed;
  };
  const bool ended = runner_.Run({.spec = spec, .scenario = scenario}, {.next = next, .add = add});
  if (!ended) throw Stopped();
  std::vector<Evaluation> evaluations;
  for (Running& r : running) evaluations.push_back(std::move(r.evaluation));
  return evaluations;
}

}  // namespace turbidock::tuning
