#include "experiments/studies/tuning/evaluations.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>

#include "experiments/farm/keep_busy.h"
#include "experiments/system/build_info.h"
#include "sim/base/check.h"
#include "sim/base/fields.h"

namespace turbidock::tuning {
namespace {

// Trials of an evaluation are numbered from a multiple of this.
constexpr int64_t kNumbers = 1'000'000;
constexpr const char* kPhaseKey = "phase";

farm::StoreHeader HeaderOf(const Study& study) {
  farm::StoreHeader header{.kind = "tune",
                           .plan = study.resolved(),
                           .plan_hash = study.hash(),
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
      pool_(options.workers, {.time_limit_s = options.trial_time_limit_s}) {
  for (farm::StoredTrial& trial : store_.Trials()) known_.emplace(trial.trial, std::move(trial));
}

std::vector<Evaluation> Evaluations::Run(const std::string& phase, const farm::Plan& plan,
                                         const std::vector<Request>& requests, const GoOn& go_on) {
  TD_CHECK(plan.trials() < kNumbers, "an evaluation's trials have numbers of their own");
  const std::vector<int64_t> order = Study::FairOrder(plan);
  const auto total = std::ssize(order);
  const RacingParams& racing = study_.settings().racing;

  struct Running {
    Evaluation evaluation;
    int64_t wanted = 0;  // trials up to the next look
    int64_t asked = 0;   // handed out or found
    int64_t done = 0;
    std::vector<std::optional<trial::TrialRecord>> records;
    bool ended = false;
  };
  std::vector<Running> running(requests.size());
  const auto parameters = [&](const Running& r) {
    std::vector<farm::Parameter> values = {{kPhaseKey, phase}};
    for (size_t i = 0; i < r.evaluation.gains.size(); ++i)
      values.push_back({study_.settings().gains[i].key, FormatNumber(r.evaluation.gains[i])});
    return values;
  };
  for (size_t i = 0; i < requests.size(); ++i) {
    Running& r = running[i];
    r.evaluation.number = evaluations_++;
    r.evaluation.gains = requests[i].gains;
    r.records.resize(order.size());
    r.wanted = go_on ? std::min<int64_t>(racing.first, total) : total;
  }

  // A look decides by the trials before it only, whatever else is known: the same whenever it is
  // taken.
  const auto look = [&](Running* r) {
    while (!r->ended && r->done == r->wanted) {
      r->evaluation.records.clear();
      for (int64_t i = 0; i < r->wanted; ++i)
        r->evaluation.records.push_back(*r->records[static_cast<size_t>(i)]);
      if (r->wanted == total) {
        r->ended = true;
      } else if (!go_on(r->evaluation)) {
        r->ended = r->evaluation.given_up = true;
      } else {
        r->wanted = std::min<int64_t>(r->wanted + racing.every, total);
        return;  // there is more to ask for
      }
    }
  };
  const auto take = [&](Running* r, int64_t index, trial::TrialRecord record) {
    r->records[static_cast<size_t>(index)] = std::move(record);
    ++r->done;
    ++trials_;
    look(r);
  };
  // The next trial that is not known, of the first candidate that has one to ask for.
  const auto submit_one = [&]() -> bool {
    for (size_t i = 0; i < running.size(); ++i) {
      Running& r = running[i];
      while (!r.ended && r.asked < r.wanted) {
        const int64_t index = r.asked++;
        const int64_t id = r.evaluation.number * kNumbers + index;
        if (const auto found = known_.find(id); found != known_.end()) {
          if (found->second.parameters != parameters(r))
            throw farm::MismatchError(fmt::format(
                "trial {} of the file is of other gains than this program asks for", id));
          take(&r, index, found->second.record);
          continue;
        }
        const int64_t trial = order[static_cast<size_t>(index)];
        trial::Scenario scenario = study_.ScenarioOf(plan, trial, r.evaluation.gains);
        if (requests[i].change) requests[i].change(&scenario);
        pool_.Submit({.id = id, .scenario = scenario});
        return true;
      }
    }
    return false;
  };

  const auto take_one = [&](farm::FinishedTrial finished) {
    const int64_t id = finished.id, index = id % kNumbers;
    Running& r = running[static_cast<size_t>(id / kNumbers - running[0].evaluation.number)];
    store_.Add({.trial = id,
                .cell = r.evaluation.number,
                .sample = index,
                .parameters = parameters(r),
                .record = finished.record});
    ++trials_run_;
    worker_time_s_ += finished.record.wall_time_s;
    take(&r, index, std::move(finished.record));
  };
  const bool all_ended = farm::KeepBusy(&pool_, submit_one, take_one, [&] {
    if (options_.on_trial) options_.on_trial();
    return !options_.stop_requested || !options_.stop_requested();
  });
  if (!all_ended) throw Stopped();
  std::vector<Evaluation> evaluations;
  evaluations.reserve(running.size());
  for (Running& r : running) evaluations.push_back(std::move(r.evaluation));
  return evaluations;
}

}  // namespace turbidock::tuning
