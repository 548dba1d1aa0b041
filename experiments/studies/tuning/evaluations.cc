#include "experiments/studies/tuning/evaluations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "experiments/system/build_info.h"
#include "sim/base/check.h"
#include "sim/base/fields.h"

namespace turbidock::tuning {
namespace {

constexpr const char* kPhaseKey = "phase";

// An evaluation whose trials are under way. Its records are those up to the next look.
struct Running {
  const Evaluations::Request& request;
  Evaluation evaluation;
  size_t asked = 0;
  size_t done = 0;
  bool ended = false;
};

farm::StoreHeader HeaderOf(const Study& study) {
  farm::StoreHeader header{.kind = "tune",
                           .plan = study.resolved(),
                           .build = system::BuildId(),
                           .shard = {},
                           .trials = 0,
                           .keys = {kPhaseKey}};
  for (const GainRange& gain : study.settings().gains) header.keys.push_back(gain.key);
  return header;
}

}  // namespace

double Evaluation::success_rate() const {
  if (records.empty()) return 0;
  const auto successes = std::count_if(records.begin(), records.end(),
                                       [](const trial::TrialRecord& r) { return r.success(); });
  return static_cast<double>(successes) / static_cast<double>(records.size());
}

Evaluations::Evaluations(const Study& study, const std::string& file, const Options& options)
    : study_(study),
      file_(file),
      store_(farm::ResultStore::Write(file, HeaderOf(study))),
      runner_({.farm = options.farm,
               .time_limit_s = options.trial_time_limit_s,
               .plugins = study.plugins(),
               .on_progress =
                   [this, report = options.on_trial](const farm::RunProgress&) {
                     if (report) report(trials_);
                   },
               .stop_requested = options.stop_requested},
              &store_) {}

std::vector<farm::Parameter> Evaluations::ParametersOf(const std::string& phase,
                                                       const Gains& gains) const {
  std::vector<farm::Parameter> values = {{kPhaseKey, phase}};
  for (size_t i = 0; i < gains.size(); ++i)
    values.push_back({study_.settings().gains[i].key, FormatNumber(gains[i])});
  return values;
}

std::vector<Evaluation> Evaluations::Run(const std::string& phase, const farm::Plan& plan,
                                         const std::vector<Request>& requests, const GoOn& go_on) {
  TD_CHECK(plan.trials() <= kMostTrials, "an evaluation's trials have numbers of their own");
  const std::vector<int64_t> order = Study::FairOrder(plan);
  const RacingParams& racing = study_.settings().racing;
  std::vector<Running> running;
  running.reserve(requests.size());
  for (const Request& request : requests) {
    running.push_back({.request = request, .evaluation = {evaluations_++, request.gains}});
    const size_t first = go_on ? static_cast<size_t>(racing.first) : order.size();
    running.back().evaluation.records.resize(std::min(first, order.size()));
  }

  const auto running_of = [&](int64_t evaluation) -> Running& {
    return running[static_cast<size_t>(evaluation - running.front().evaluation.number)];
  };
  // The next trial of the first candidate that has one to ask for.
  const auto next = [&]() -> std::optional<int64_t> {
    for (Running& r : running)
      if (r.asked < r.evaluation.records.size() && !r.ended)
        return r.evaluation.number * kMostTrials + static_cast<int64_t>(r.asked++);
    return std::nullopt;
  };
  // A look decides by the trials before it only, whatever else is known: the same whenever it is
  // taken.
  const auto add = [&](const farm::StoredTrial& trial) {
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
  const auto spec = [&](int64_t trial) -> farm::TrialSpec {
    const int64_t evaluation = trial / kMostTrials, index = trial % kMostTrials;
    return {.trial = trial,
            .cell = evaluation,
            .sample = index,
            .seed = plan.Trial(order[static_cast<size_t>(index)]).seed,
            .parameters = ParametersOf(phase, running_of(evaluation).evaluation.gains)};
  };
  const auto scenario = [&](const farm::TrialSpec& of) {
    const Running& r = running_of(of.cell);
    trial::Scenario changed =
        study_.ScenarioOf(plan, order[static_cast<size_t>(of.sample)], r.evaluation.gains);
    if (r.request.change) r.request.change(&changed);
    return changed;
  };
  const farm::TrialSource source = {.spec = spec, .scenario = scenario};
  const farm::TrialDecider decider = {.next = next, .add = add};
  if (!runner_.Run(source, decider)) throw Stopped();
  std::vector<Evaluation> evaluations;
  evaluations.reserve(running.size());
  for (Running& r : running) evaluations.push_back(std::move(r.evaluation));
  return evaluations;
}

}  // namespace turbidock::tuning
