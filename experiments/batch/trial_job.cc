#include "experiments/batch/trial_job.h"

#include <fmt/format.h>

#include "experiments/report/json.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/trial.h"
#include "sim/base/check.h"

namespace turbidock::batch {

Work TrialWork(const trial::Plugins& plugins) {
  return {"trial", [plugins](const std::string& input) {
            const report::Json job = report::ParseJson(input, "a worker's job");
            const trial::TrialResult result = trial::RunTrial(
                trial::ParseScenario(job["scenario"], "resolved scenario", plugins));
            const int every_frames = job["series_every_frames"];
            const auto series =
                every_frames > 0 ? trial::Series::Of(result.log, every_frames) : trial::Series();
            return report::JsonLine({{"cells", trial::CellsOf(result)}, {"series", series}});
          }};
}

Job TrialJob(int64_t id, const trial::Scenario& scenario, int series_every_frames) {
  return {.id = id,
          .input = report::JsonLine({{"scenario", trial::SaveScenario(scenario)},
                                     {"series_every_frames", series_every_frames}})};
}

FinishedTrial FinishedTrialOf(const JobResult& result, int64_t seed) {
  if (result.end == JobEnd::kBadInput)
    throw ConfigError(fmt::format("trial {}: {}", result.id, result.error));
  if (result.end == JobEnd::kFault)
    throw SimulatorFault(fmt::format("trial {}: {}", result.id, result.error));
  FinishedTrial trial{.record = {}};
  trial::TrialRecord& record = trial.record;
  if (result.end == JobEnd::kDone) {
    const report::Json json = report::ParseJson(result.output, "a worker's trial");
    record = trial::RecordOf(json["cells"].get<std::vector<trial::Cell>>());
    trial.series = json["series"].get<trial::Series>();
  } else {
    const bool hung = result.end == JobEnd::kHung;
    record.outcome = hung ? trial::Outcome::kHung : trial::Outcome::kCrashed;
    record.failure = hung ? trial::Failure::kHung : trial::Failure::kCrashed;
    record.seed = seed;
    record.reason = result.error;
    record.printed = result.log;
  }
  record.wall_time_s = result.wall_time_s;
  record.cpu_time_s = result.cpu_time_s;
  record.rss_bytes = result.rss_bytes;
  return trial;
}

}  // namespace turbidock::batch
