#include "experiments/studies/recognition/recognition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/batch/runner.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/system/build_info.h"
#include "experiments/trial/identity.h"
#include "experiments/trial/trial_view.h"
#include "experiments/trial/world.h"

namespace turbidock::recognition {
namespace {

constexpr const char* kMilk = "water.milk_ml_m3";

// A trial's cell of the grid, without the milk.
std::string NameOfCell(const batch::TrialSpec& spec, const batch::Plan& plan) {
  std::string name;
  for (size_t i = 0; i < plan.grid().size(); ++i) {
    const auto& [key, value] = spec.parameters[i];
    if (key == kMilk) continue;
    const bool is_name = key == "case" || key == "scenario";
    name += name.empty() ? "" : ", ";
    name += is_name ? value : fmt::format("{} {}", key, value);
  }
  return name;
}

CellResult RunCell(const trial::Scenario& scenario, double seconds, double settle_s) {
  const RecognitionCell cell = CellOf(scenario);
  const trial::FixedView view =
      trial::DrawFixedViews(scenario, {trial::StartPose(scenario).Inverse()}).front();
  camera::StereoCamera cameras = CamerasOf(view, trial::WaterOf(view, scenario), scenario, cell);
  const std::string name = scenario.estimator_name();
  const auto estimator =
      scenario.MakeEstimator(name, SeedsOf(scenario, cell).Stream("vision." + name));
  const int64_t settled = scenario.clock.FramesFor(settle_s);
  const int64_t last = settled + std::max<int64_t>(1, scenario.clock.FramesFor(seconds));
  StereoImage seen;
  CellResult result{.cell = cell};
  std::vector<float> fitness;
  for (int64_t frame = 0; frame < last; ++frame) {
    cameras.ExposeHeld(estimator->RegionOfInterest().value_or(WholeImages(view.rig)), frame, &seen);
    const PoseEstimate& estimate = estimator->Update(seen);
    if (frame < settled) continue;
    fitness.push_back(static_cast<float>(estimate.fitness));
    const double error_m = (estimate.X_HM.p - view.X_HM.p).norm();
    const bool is_right =
        error_m <= 0.02 && AngleBetween(estimate.X_HM.q, view.X_HM.q) <= units::RadFromDeg(5);
    if (estimate.detected) ++(is_right ? result.right : result.wrong_and_sure);
    result.position_error_mean_m += error_m;
    result.last_X_HM = estimate.X_HM;
  }
  for (double* mean : {&result.position_error_mean_m, &result.right, &result.wrong_and_sure})
    *mean /= static_cast<double>(last - settled);
  SetFitness(std::move(fitness), &result);
  return result;
}

}  // namespace

Area AreaOf(double fitness_mean) {
  constexpr trial::ViewCriteria kPublished;
  if (fitness_mean >= kPublished.docking_fitness) return Area::kI;
  return fitness_mean >= kPublished.detection_fitness ? Area::kII : Area::kIII;
}

void SetFitness(std::vector<float> fitness, CellResult* result) {
  const Eigen::ArrayXd f =
      Eigen::Map<const Eigen::ArrayXf>(fitness.data(), std::ssize(fitness)).cast<double>();
  result->fitness_mean = f.mean();
  result->fitness_std = std::sqrt((f - f.mean()).square().mean());
  result->area = AreaOf(result->fitness_mean);
  result->fitness = std::move(fitness);
}

trial::Scenario RecognitionScenario(MarkerKind marker, const std::vector<std::string>& assignments,
                                    const trial::Plugins& plugins) {
  std::vector<std::string> all = {fmt::format("trial.scene=tank_{}.xml", NameOf(marker)),
                                  "cameras.optics=published"};
  all.insert(all.end(), assignments.begin(), assignments.end());
  trial::Scenario scenario =
      trial::LoadScenario(fmt::format("pool_{}", NameOf(marker)), all, "", plugins);
  if (scenario.pose_source != trial::PoseSource::kCameras)
    throw ConfigError("estimator.pose_source",
                      "must be cameras: the marker is recognised in images");
  return scenario;
}

RecognitionCell CellOf(const trial::Scenario& scenario) {
  constexpr double kSteps_per_m = 1e4;  // so that a distance is that of a table
  return {scenario.light.ball_lights.enabled ? MarkerKind::kActive : MarkerKind::kPassive,
          scenario.light.water.milk_ml_m3,
          std::round(trial::StartPose(scenario).p.norm() * kSteps_per_m) / kSteps_per_m};
}

trial::FixedView ViewOf(const trial::Scenario& scenario, const RecognitionCell& cell) {
  return trial::DrawFixedViews(scenario, {Pose::Translation(cell.distance_m, 0, 0)}).front();
}

SeedTree SeedsOf(const trial::Scenario& scenario, const RecognitionCell& cell) {
  return SeedTree(
      SeedTree(static_cast<uint64_t>(scenario.seed))
          .Stream(fmt::format("recognition {} {} {}", NameOf(cell.marker),
                              FormatNumber(cell.milk_ml_m3), FormatNumber(cell.distance_m)))
          .NextU64());
}

light::Water WaterOf(const trial::FixedView& view, trial::Scenario scenario,
                     const RecognitionCell& cell) {
  trial::Resolve({config::ParseAssignment("water.milk_ml_m3=" + FormatNumber(cell.milk_ml_m3))},
                 &scenario);
  return trial::WaterOf(view, scenario);
}

camera::StereoCamera CamerasOf(const trial::FixedView& view, light::Water water,
                               const trial::Scenario& scenario, const RecognitionCell& cell) {
  return trial::HoldView(view, std::move(water), scenario, SeedsOf(scenario, cell));
}

std::vector<batch::PlanKey> RefusedKeys() {
  return {batch::kNoRanges,
          {"precision", "recognition has no success rate; give --seeds"},
          {"series_every_frames", "the vehicle is at rest: there is no log"}};
}

batch::Work CellWork(const trial::Plugins& plugins) {
  return {"recognition cell", [plugins](const std::string& input) {
            const report::Json json = report::ParseJson(input, "a cell");
            const trial::Scenario scenario =
                trial::ParseScenario(json["scenario"], "a cell", plugins);
            trial::RequireSameFiles(scenario);
            const CellResult result = RunCell(scenario, json["seconds"], json["settle_s"]);
            return report::JsonLine({{"cell", result.cell},
                                     {"error_m", result.position_error_mean_m},
                                     {"right", result.right},
                                     {"wrong_and_sure", result.wrong_and_sure},
                                     {"fitness", result.fitness},
                                     {"q", result.last_X_HM.q},
                                     {"p", result.last_X_HM.p}});
          }};
}

std::vector<CellResult> Recognize(const batch::Plan& plan, const RecognitionOptions& options) {
  const report::Json time = {{"seconds", options.seconds}, {"settle_s", options.settle_s}};
  std::vector<std::string> inputs;
  std::vector<CellResult> results;
  for (int64_t trial = 0; trial < plan.trials(); ++trial) {
    const batch::TrialSpec spec = plan.Trial(trial);
    const trial::Scenario scenario = plan.ScenarioOf(spec);
    if (scenario.pose_source != trial::PoseSource::kCameras)
      throw ConfigError("estimator.pose_source",
                        "must be cameras: the marker is recognised in images");
    report::Json input = time;
    input["scenario"] = trial::SaveScenario(scenario);
    inputs.push_back(report::JsonLine(input));
    results.push_back({.cell = {}, .trial = trial, .name = NameOfCell(spec, plan)});
  }
  std::optional<batch::ResultStore> store;
  if (!options.file.empty())
    store.emplace(batch::ResultStore::Write(
        options.file, {.kind = "recognize",
                       .plan = plan.resolved() + "time: " + report::JsonLine(time) + "\n",
                       .build = system::BuildId(),
                       .code = plan.code(),
                       .shard = {},
                       .keys = {}}));
  int done = 0;
  const auto take = [&](size_t i, const std::string& output) {
    const report::Json json = report::ParseJson(output, "a worker's result");
    CellResult& result = results[i];
    json["cell"].get_to(result.cell);
    result.position_error_mean_m = json["error_m"];
    result.right = json["right"];
    result.wrong_and_sure = json["wrong_and_sure"];
    SetFitness(json["fitness"], &result);
    json["q"].get_to(result.last_X_HM.q);
    json["p"].get_to(result.last_X_HM.p);
    if (options.on_progress) options.on_progress(++done, static_cast<int>(results.size()));
  };
  const auto pool =
      batch::MakePool(options.jobs, plan.settings().trial_time_limit_s, CellWork(plan.plugins()));
  if (!batch::MapEachKept(pool.get(), store ? &*store : nullptr, 0, inputs, take,
                          options.stop_requested))
    return {};
  return results;
}

}  // namespace turbidock::recognition
