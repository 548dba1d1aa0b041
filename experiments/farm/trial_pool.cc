#include "experiments/farm/trial_pool.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "experiments/config/yaml_fields.h"
#include "experiments/trial/trial_files.h"
#include "sim/base/check.h"

namespace turbidock::farm {
namespace {

using Json = nlohmann::ordered_json;

void AddError(const std::string& name, const trial::PoseError& error,
              std::vector<Metric>* metrics) {
  metrics->emplace_back(name + "_x_m", error.x_m);
  metrics->emplace_back(name + "_y_m", error.y_m);
  metrics->emplace_back(name + "_z_m", error.z_m);
  metrics->emplace_back(name + "_yaw_rad", error.yaw_rad);
}

// The log with every n-th frame only.
trial::TrialLog Thinned(const trial::TrialLog& log, int every_frames) {
  trial::TrialLog thinned;
  for (size_t i = 0; i < log.frames.size(); i += static_cast<size_t>(every_frames))
    thinned.frames.push_back(log.frames[i]);
  return thinned;
}

// ------------------------------------------------------------------- between the two processes

std::string ToText(const TrialJob& job) {
  return Json{{"trial", job.id},
              {"scenario", trial::SaveScenario(job.scenario)},
              {"series_every_frames", job.series_every_frames}}
      .dump();
}

TrialJob JobFromText(const std::string& text) {
  const Json json = Json::parse(text);
  return {.id = json["trial"],
          .scenario = trial::ParseScenario(json["scenario"], "resolved scenario"),
          .series_every_frames = json["series_every_frames"]};
}

std::string ToText(const TrialRecord& record) {
  Json metrics = Json::object();
  for (const auto& [name, value] : record.metrics) metrics[name] = value ? Json(*value) : Json();
  return Json{{"trial", record.trial},          {"seed", record.seed},
              {"outcome", record.outcome},      {"failure", record.failure},
              {"reason", record.reason},        {"docked", record.docked},
              {"inserted", record.inserted},    {"time_s", record.time_s},
              {"digest", record.digest},        {"metrics", metrics},
              {"series_csv", record.series_csv}}
      .dump();
}

TrialRecord RecordFromText(const std::string& text) {
  const Json json = Json::parse(text);
  TrialRecord record;
  record.trial = json["trial"];
  record.seed = json["seed"];
  record.outcome = json["outcome"];
  record.failure = json["failure"];
  record.reason = json["reason"];
  record.docked = json["docked"];
  record.inserted = json["inserted"];
  record.time_s = json["time_s"];
  record.digest = json["digest"];
  for (const auto& [name, value] : json["metrics"].items())
    record.metrics.emplace_back(
        name, value.is_null() ? std::nullopt : std::optional(value.get<double>()));
  record.series_csv = json["series_csv"];
  return record;
}

std::string Work(const std::string& input) {
  const TrialJob job = JobFromText(input);
  return ToText(RecordOf(job, trial::RunTrial(job.scenario)));
}

}  // namespace

std::vector<Metric> MetricsOf(const trial::Scenario& scenario, const trial::TrialResult& result) {
  const Pose X_MH = DrawStart(scenario);
  std::vector<Metric> metrics = {{"start_x_m", X_MH.p.x()},
                                 {"start_y_m", X_MH.p.y()},
                                 {"start_z_m", X_MH.p.z()},
                                 {"start_yaw_rad", YawOf(X_MH.q)}};
  AddError("final_error_true", result.final_error_true, &metrics);
  AddError("final_error_estimated", result.final_error_estimated, &metrics);
  const auto& contact = result.first_dock_contact;
  metrics.insert(
      metrics.end(),
      {{"fitness_mean", result.fitness_mean},
       {"fitness_best", result.fitness_best},
       {"returns_to_servoing", result.returns_to_servoing},
       {"tracking_rms_m", result.tracking_rms_m},
       {"overshoot_m", result.overshoot_m},
       {"effort_v", result.effort_v},
       {"insertion_depth_m", result.insertion_depth_m},
       {"insertion_time_s", result.insertion_time_s},
       {"dock_contact_time_s", contact ? std::optional(contact->time_s) : std::nullopt},
       {"dock_contact_force_newton", contact ? std::optional(contact->force_newton) : std::nullopt},
       {"dock_force_max_newton", result.dock_force_max_newton},
       {"jam_time_s", result.jam_time_s},
       {"thruster_work_joule", result.energy.thruster_work}});
  for (const auto& [stage, name] : EnumNames<control::Stage>::kNames) {
    const auto found = result.stage_time_s.find(stage);
    metrics.emplace_back(std::string(name) + "_time_s",
                         found == result.stage_time_s.end() ? 0 : found->second);
  }
  return metrics;
}

TrialRecord RecordOf(const TrialJob& job, const trial::TrialResult& result) {
  TrialRecord record;
  record.trial = job.id;
  record.seed = result.seed;
  record.outcome = NameOf(result.outcome);
  record.failure = NameOf(trial::FailureOf(job.scenario, result));
  record.reason = result.reason;
  record.docked = result.docked;
  record.inserted = result.inserted;
  record.time_s = result.time_s;
  record.digest = result.digest;
  record.metrics = MetricsOf(job.scenario, result);
  if (job.series_every_frames > 0)
    record.series_csv = trial::TrajectoryCsv(Thinned(result.log, job.series_every_frames));
  return record;
}

TrialPool::TrialPool(int workers, const WorkerOptions& options) : pool_(workers, options, Work) {}

void TrialPool::Submit(const TrialJob& job) {
  seeds_.emplace_back(job.id, job.scenario.seed);
  pool_.Submit({.id = job.id, .input = ToText(job)});
}

std::optional<TrialRecord> TrialPool::Next(double timeout_s) {
  const std::optional<JobResult> result = pool_.Next(timeout_s);
  if (!result) return std::nullopt;
  const auto pending = std::find_if(seeds_.begin(), seeds_.end(),
                                    [&](const auto& entry) { return entry.first == result->id; });
  TD_CHECK(pending != seeds_.end(), "a result belongs to a trial that was submitted");
  const int64_t seed = pending->second;
  seeds_.erase(pending);

  if (result->end == JobEnd::kBadInput)
    throw ConfigError(fmt::format("trial {}: {}", result->id, result->error));
  if (result->end == JobEnd::kFault)
    throw SimulatorFault(fmt::format("trial {}: {}", result->id, result->error));
  TrialRecord record;
  if (result->end == JobEnd::kDone) {
    record = RecordFromText(result->output);
  } else {
    record.trial = result->id;
    record.seed = seed;
    record.outcome =
        NameOf(result->end == JobEnd::kHung ? trial::Failure::kHung : trial::Failure::kCrashed);
    record.failure = record.outcome;
    record.reason = result->error;
    record.metrics = MetricsOf({}, {});
    for (auto& [name, value] : record.metrics) value.reset();
    record.log = result->log;
  }
  record.wall_time_s = result->wall_time_s;
  record.cpu_time_s = result->cpu_time_s;
  record.rss_bytes = result->rss_bytes;
  return record;
}

}  // namespace turbidock::farm
