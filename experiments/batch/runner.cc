#include "experiments/batch/runner.h"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "experiments/report/json.h"
#include "experiments/system/base64.h"
#include "experiments/trial/identity.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/trial.h"
#include "sim/base/check.h"

namespace turbidock::batch {

TrialSource SourceOf(const Plan& plan) {
  return {.spec = [&plan](int64_t trial) { return plan.Trial(trial); },
          .scenario = [&plan](const TrialSpec& spec) { return plan.ScenarioOf(spec); },
          .series_every_frames = plan.settings().series_every_frames};
}

Work TrialWork(const trial::Plugins& plugins) {
  return {"trial", [plugins](const std::string& input) {
            const report::Json job = report::ParseJson(input, "a worker's job");
            const trial::Scenario scenario =
                trial::ParseScenario(job["scenario"], "resolved scenario", plugins);
            trial::RequireSameFiles(scenario);
            const int every_frames = job["series_every_frames"];
            try {
              const trial::TrialResult result = trial::RunTrial(scenario);
              const auto series =
                  every_frames > 0 ? trial::Series::Of(result.log, every_frames) : trial::Series();
              return report::JsonLine(
                  {{"cells", trial::CellsOf(result)}, {"series", system::Base64(series.Bytes())}});
            } catch (const trial::NoAnswer& error) {
              return report::JsonLine({{"no_answer", error.what()}});
            }
          }};
}

Job TrialJob(int64_t id, const trial::Scenario& scenario, int series_every_frames) {
  return {.id = id,
          .input = report::JsonLine({{"scenario", trial::SaveScenario(scenario)},
                                     {"series_every_frames", series_every_frames}})};
}

StoredTrial FinishedTrialOf(const JobResult& result, TrialSpec spec) {
  if (result.end == JobEnd::kBadInput)
    throw ConfigError(fmt::format("trial {}: {}", result.id, result.error));
  if (result.end == JobEnd::kFault)
    throw SimulatorFault(fmt::format("trial {}: {}", result.id, result.error));
  StoredTrial trial{.trial = spec.trial,
                    .cell = spec.cell,
                    .sample = spec.sample,
                    .parameters = std::move(spec.parameters),
                    .record = {}};
  trial::TrialRecord& record = trial.record;
  const auto without_end = [&](trial::Outcome outcome, trial::Failure failure, std::string reason) {
    record.outcome = outcome;
    record.failure = failure;
    record.seed = spec.seed;
    record.reason = std::move(reason);
    record.printed = result.log;
  };
  if (result.end == JobEnd::kDone) {
    const report::Json json = report::ParseJson(result.output, "a worker's trial");
    if (json.contains("no_answer")) {
      without_end(trial::Outcome::kNoAnswer, trial::Failure::kNoAnswer, json["no_answer"]);
    } else {
      record = trial::RecordOf(json["cells"].get<std::vector<trial::Cell>>());
      trial.series = trial::Series::FromBytes(system::BytesOf(json["series"].get<std::string>()));
    }
  } else if (result.end == JobEnd::kHung) {
    without_end(trial::Outcome::kHung, trial::Failure::kHung, result.error);
  } else {
    without_end(trial::Outcome::kCrashed, trial::Failure::kCrashed, result.error);
  }
  record.wall_time_s = result.wall_time_s;
  record.cpu_time_s = result.cpu_time_s;
  record.rss_bytes = result.rss_bytes;
  return trial;
}

bool MapEachKept(JobPool* pool, ResultStore* store, int64_t first,
                 const std::vector<std::string>& inputs,
                 const std::function<void(size_t, const std::string& output)>& take,
                 const std::function<bool()>& stop_requested) {
  std::vector<std::string> missing;
  std::vector<size_t> index;  // of each of those among all
  for (size_t i = 0; i < inputs.size(); ++i) {
    const auto known =
        store ? store->OutputOf(first + static_cast<int64_t>(i), inputs[i]) : std::nullopt;
    if (known) {
      take(i, *known);
    } else {
      missing.push_back(inputs[i]);
      index.push_back(i);
    }
  }
  const auto take_new = [&](size_t i, const std::string& output) {
    if (store) store->AddOutput(first + static_cast<int64_t>(index[i]), missing[i], output);
    take(index[i], output);
  };
  return MapEach(pool, missing, take_new, stop_requested);
}

TrialRunner::TrialRunner(const RunOptions& options, ResultStore* store)
    : options_(options),
      store_(store),
      pool_(MakePool(options.jobs, options.time_limit_s, TrialWork(options.plugins))) {}

std::optional<StoredTrial> TrialRunner::Find(const TrialSpec& spec,
                                             const trial::Scenario& scenario) const {
  if (!store_) return std::nullopt;
  std::optional<StoredTrial> known = store_->Find(spec.trial);
  if (known && (known->parameters != spec.parameters || known->record.seed != spec.seed ||
                known->identity != trial::IdentityOf(scenario, program_, known->record.renderer)))
    throw MismatchError(
        fmt::format("trial {} in the file is not the one that this program would run", spec.trial));
  return known;
}

void TrialRunner::RequireSameRenderer(int64_t trial, view::GlBackend asked,
                                      const std::string& drawn) {
  if (drawn.empty()) return;
  const std::string& others = renderers_.try_emplace(asked, drawn).first->second;
  if (others != drawn)
    throw MismatchError(
        fmt::format("trial {} was drawn by {}, others by {}", trial, drawn, others));
}

bool TrialRunner::Run(const TrialSource& source, const TrialDecider& decider) {
  struct UnderWay {
    TrialSpec spec;
    trial::Scenario scenario;
  };
  std::multimap<int64_t, UnderWay> under_way;  // whoever asks twice gets a trial twice
  const auto submit_one = [&] {
    while (const std::optional<int64_t> trial = decider.next()) {
      TrialSpec spec = source.spec(*trial);
      trial::Scenario scenario = source.scenario(spec);
      if (const auto known = Find(spec, scenario)) {
        RequireSameRenderer(*trial, scenario.renderer, known->record.renderer);
        decider.add(*known);
        continue;
      }
      pool_->Submit(TrialJob(*trial, scenario, source.series_every_frames));
      under_way.emplace(*trial, UnderWay{std::move(spec), std::move(scenario)});
      return true;
    }
    return false;
  };
  const auto take = [&](const JobResult& result) {
    UnderWay of = std::move(under_way.extract(result.id).mapped());
    StoredTrial trial = FinishedTrialOf(result, std::move(of.spec));
    RequireSameRenderer(trial.trial, of.scenario.renderer, trial.record.renderer);
    trial.identity = trial::IdentityOf(of.scenario, program_, trial.record.renderer);
    decider.add(trial);
    if (store_) store_->Add(trial);
    ++progress_.done_now;
    if (options_.on_trial) options_.on_trial(trial);
  };
  return RunAll(pool_.get(), submit_one, take, [&] {
    progress_.wall_time_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    if (options_.on_progress) options_.on_progress(progress_);
    return !options_.stop_requested || !options_.stop_requested();
  });
}

}  // namespace turbidock::batch
