#include "experiments/studies/tuning/evaluations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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
  size_t asked = 0;  // handed out or found
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
      options_(options),
      store_(farm::ResultStore::Write(file, HeaderOf(study))),
      pool_(options.farm, options.trial_time_limit_s, study.plugins()) {
  for (farm::StoredTrial& trial : store_.Trials()) {
    if (!std::isfinite(trial.record.time_s))
      throw ConfigError(file + fmt::format(": is damaged (trial {} has no time)", trial.trial));
    known_.emplace(trial.trial, std::move(trial));
  }
}

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

  const auto take = [&](Running* r, size_t index, trial::TrialRecord record) {
    std::vector<trial::TrialRecord>& records = r->evaluation.records;
    records[index] = std::move(record);
    ++trials_;
    if (++r->done < records.size()) return;
    // A look decides by the trials before it only, whatever else is known: the same whenever it is
    // taken.
    if (records.size() == order.size() || !go_on(r->evaluation)) {
      r->evaluation.given_up = records.size() < order.size();
      r->ended = true;
    } else {
      records.resize(std::min(records.size() + static_cast<size_t>(racing.every), order.size()));
    }
  };
  std::map<int64_t, std::pair<Running*, size_t>> under_way;  // by the trial's number
  // The next trial that is not known, of the first candidate that has one to ask for.
  const auto submit_one = [&]() -> bool {
    for (Running& r : running)
      while (!r.ended && r.asked < r.evaluation.records.size()) {
        const size_t index = r.asked++;
        const int64_t number = r.evaluation.number * kMostTrials + static_cast<int64_t>(index);
        if (const auto found = known_.find(number); found != known_.end()) {
          if (found->second.parameters != ParametersOf(phase, r.evaluation.gains))
            throw farm::MismatchError(fmt::format(
                "trial {} of the file is of other gains than this program asks for", number));
          take(&r, index, found->second.record);
          continue;
        }
        trial::Scenario scenario = study_.ScenarioOf(plan, order[index], r.evaluation.gains);
        if (r.request.change) r.request.change(&scenario);
        pool_.Submit({.id = number, .scenario = scenario});
        under_way[number] = {&r, index};
        return true;
      }
    return false;
  };
  const auto take_one = [&](farm::FinishedTrial finished) {
    const auto [r, index] = under_way.extract(finished.id).mapped();
    store_.Add({.trial = finished.id,
                .cell = r->evaluation.number,
                .sample = static_cast<int64_t>(index),
                .parameters = ParametersOf(phase, r->evaluation.gains),
                .record = finished.record});
    ++trials_run_;
    worker_time_s_ += finished.record.wall_time_s;
    take(r, index, std::move(finished.record));
  };
  const bool all_ended = farm::RunAll(&pool_, submit_one, take_one, [&] {
    if (options_.on_trial) options_.on_trial(trials_);
    return !options_.stop_requested || !options_.stop_requested();
  });
  if (!all_ended) throw Stopped();
  std::vector<Evaluation> evaluations;
  evaluations.reserve(running.size());
  for (Running& r : running) evaluations.push_back(std::move(r.evaluation));
  return evaluations;
}

}  // namespace turbidock::tuning
