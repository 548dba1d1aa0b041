#include "experiments/farm/trial_pool.h"

#include <fmt/format.h>

#include "experiments/report/json.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/trial.h"
#include "sim/base/check.h"

namespace turbidock::farm {
namespace {

using report::Json;

// ------------------------------------------------------------------- between the two processes

std::string ToText(const TrialJob& job) {
  return report::JsonLine({{"trial", job.id},
                           {"scenario", trial::SaveScenario(job.scenario)},
                           {"series_every_frames", job.series_every_frames}});
}

TrialJob JobFromText(const std::string& text, const trial::Plugins& plugins) {
  const Json json = report::ParseJson(text, "a worker's job");
  return {.id = json["trial"],
          .scenario = trial::ParseScenario(json["scenario"], "resolved scenario", plugins),
          .series_every_frames = json["series_every_frames"]};
}

std::string ToText(const FinishedTrial& trial) {
  return report::JsonLine(
      {{"trial", trial.id}, {"cells", trial::CellsOf(trial.record)}, {"series", trial.series}});
}

FinishedTrial FinishedFromText(const std::string& text) {
  const Json json = report::ParseJson(text, "a worker's trial");
  return {json["trial"], trial::RecordOf(json["cells"].get<std::vector<trial::Cell>>()),
          json["series"].get<trial::Series>()};
}

std::string RunJob(const std::string& input, const trial::Plugins& plugins) {
  const TrialJob job = JobFromText(input, plugins);
  const trial::TrialResult result = trial::RunTrial(job.scenario);
  FinishedTrial trial{job.id, result};
  if (job.series_every_frames > 0)
    trial.series = trial::Series::Of(result.log, job.series_every_frames);
  return ToText(trial);
}

}  // namespace

Work TrialWork(const trial::Plugins& plugins) {
  return {"trial", [plugins](const std::string& input) { return RunJob(input, plugins); }};
}

TrialPool::TrialPool(const FarmOptions& farm, double time_limit_s, const trial::Plugins& plugins)
    : pool_(MakePool(farm, time_limit_s, TrialWork(plugins))) {}

void TrialPool::Submit(const TrialJob& job) {
  seeds_.emplace(job.id, job.scenario.seed);
  pool_->Submit({.id = job.id, .input = ToText(job)});
}

std::optional<FinishedTrial> TrialPool::Next(double timeout_s) {
  const std::optional<JobResult> result = pool_->Next(timeout_s);
  if (!result) return std::nullopt;
  const auto pending = seeds_.extract(result->id);
  TD_CHECK(pending, "a result belongs to a trial that was submitted");

  if (result->end == JobEnd::kBadInput)
    throw ConfigError(fmt::format("trial {}: {}", result->id, result->error));
  if (result->end == JobEnd::kFault)
    throw SimulatorFault(fmt::format("trial {}: {}", result->id, result->error));
  FinishedTrial trial{.id = result->id, .record = {}};
  trial::TrialRecord& record = trial.record;
  if (result->end == JobEnd::kDone) {
    trial = FinishedFromText(result->output);
  } else {
    const bool hung = result->end == JobEnd::kHung;
    record.outcome = hung ? trial::Outcome::kHung : trial::Outcome::kCrashed;
    record.failure = hung ? trial::Failure::kHung : trial::Failure::kCrashed;
    record.seed = pending.mapped();
    record.reason = result->error;
    record.printed = result->log;
  }
  record.wall_time_s = result->wall_time_s;
  record.cpu_time_s = result->cpu_time_s;
  record.rss_bytes = result->rss_bytes;
  return trial;
}

}  // namespace turbidock::farm
