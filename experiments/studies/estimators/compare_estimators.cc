#include "experiments/studies/estimators/compare_estimators.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include "experiments/farm/farm.h"
#include "experiments/report/json.h"
#include "experiments/trial/world.h"

namespace turbidock::estimators {
namespace {

using report::Json;

double ProcessorTime_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// The marker in the camera head, about a distance. All balls are in both of the published rig's
// images.
Pose DrawPose(double distance_m, Rng* rng) {
  constexpr double kYaw_rad = 0.15, kPitch_rad = 0.1;
  const auto within = [&](double half) { return rng->Uniform(-half, half); };
  const double x_m = distance_m * (1 + within(0.05));
  const double side_m = std::max(0.0, 0.4 * x_m - 0.12);
  // in braces, for the order of arguments in parentheses is the compiler's
  const Eigen::Vector3d yaw_pitch_roll{within(kYaw_rad), within(kPitch_rad), within(kPitch_rad)};
  return {FromYawPitchRoll(yaw_pitch_roll[0], yaw_pitch_roll[1], yaw_pitch_roll[2]),
          {x_m, within(side_m), within(0.75 * side_m)}};
}

// An estimator, and its scenario.
using Choice = std::pair<std::string, trial::Scenario>;

std::vector<Choice> ChoicesOf(const std::string& scenario, const CompareOptions& options) {
  std::vector<Choice> choices;
  const auto add = [&](const std::vector<std::string>& assignments) {
    trial::Scenario one = trial::LoadScenario(scenario, assignments, "", options.plugins);
    if (one.pose_source != trial::PoseSource::kCameras)
      throw ConfigError("pose_source", "must be cameras: estimators are compared on images");
    choices.emplace_back(one.estimator_name(), std::move(one));
  };
  for (const std::string& name : options.estimators) {
    std::vector<std::string> assignments = options.assignments;
    assignments.push_back("pose_estimator=" + name);
    add(assignments);
  }
  if (options.estimators.empty()) add(options.assignments);
  return choices;
}

// The scenarios differ in their estimators only.
std::vector<StartResult> RunStart(const std::vector<Choice>& choices, double distance_m,
                                  int frames) {
  const trial::Scenario& scenario = choices.front().second;
  trial::World world(scenario, {});
  Rng rng = world.seeds().Stream("compare");
  world.PlaceVehicle(DrawPose(distance_m, &rng).Inverse());
  trial::Snapshot snapshot;
  world.Take(&snapshot);
  const Pose& X_HM = snapshot.true_X_HM;
  std::vector<StereoImage> images(static_cast<size_t>(frames));
  for (int frame = 0; frame < frames; ++frame) {
    snapshot.time_s = scenario.image_clock().TimeOfFrame(frame);
    StereoImage& image = images[static_cast<size_t>(frame)];
    image.frame = frame;
    world.Develop(snapshot, frame, std::nullopt, nullptr, &image);
  }
  std::vector<StartResult> results;
  for (const auto& [name, with_keys] : choices) {
    const auto estimator = with_keys.MakeEstimator(name, world.seeds().Stream("vision." + name));
    StartResult result{.seed = scenario.seed};
    std::vector<double> times_s;
    for (const StereoImage& image : images) {
      const double start_s = ProcessorTime_s();
      const PoseEstimate& estimate = estimator->Update(image);
      times_s.push_back(ProcessorTime_s() - start_s);
      result.fitness = estimate.fitness;
      result.error_m = (estimate.X_HM.p - X_HM.p).norm();
      result.rotation_rad = AngleBetween(estimate.X_HM.q, X_HM.q);
    }
    result.is_sure = result.fitness >= scenario.procedure.lost_fitness;
    result.frame_s = *statistics::Median(times_s);
    results.push_back(result);
  }
  return results;
}

// One start of a scenario as StartWork's input.
std::string InputOf(const std::vector<Choice>& choices, const CompareCell& cell, int64_t start,
                    int frames) {
  Json scenarios = Json::array();
  for (const auto& [name, scenario] : choices) {
    trial::Scenario one = scenario;
    one.light.water.milk_ml_m3 = cell.milk_ml_m3;
    one.seed += start;
    scenarios.push_back(trial::SaveScenario(one));
  }
  return report::JsonLine(
      {{"scenarios", scenarios}, {"distance_m", cell.distance_m}, {"frames", frames}});
}

}  // namespace

farm::Work StartWork(const trial::Plugins& plugins) {
  return {"cold start", [plugins](const std::string& input) {
            const Json json = report::ParseJson(input, "a start");
            std::vector<Choice> choices;
            for (const Json& text : json["scenarios"]) {
              trial::Scenario scenario = trial::ParseScenario(text, "a start's scenario", plugins);
              choices.emplace_back(scenario.estimator_name(), std::move(scenario));
            }
            return report::JsonLine(RunStart(choices, json["distance_m"], json["frames"]));
          }};
}

void Summarise(const CompareOptions& options, CompareCell* cell) {
  std::vector<double> errors_m, rotations_rad, times_s;
  cell->starts = static_cast<int>(cell->each.size());
  cell->right = cell->wrong_and_sure = cell->not_found = 0;
  for (const StartResult& one : cell->each) {
    times_s.push_back(one.frame_s);
    if (!one.is_sure) {
      ++cell->not_found;
      continue;
    }
    errors_m.push_back(one.error_m);
    rotations_rad.push_back(one.rotation_rad);
    const bool is_right = one.error_m <= options.right_m && one.rotation_rad <= options.right_rad;
    ++(is_right ? cell->right : cell->wrong_and_sure);
  }
  cell->right_interval = statistics::WilsonInterval(cell->right, cell->starts);
  cell->wrong_and_sure_interval = statistics::WilsonInterval(cell->wrong_and_sure, cell->starts);
  cell->error_median_m = statistics::Median(errors_m);
  cell->error_median_interval_m = statistics::MedianInterval(errors_m);
  cell->rotation_median_rad = statistics::Median(rotations_rad);
  cell->frame_s = statistics::Median(times_s);
}

std::vector<CompareCell> CompareEstimators(const CompareOptions& options) {
  std::vector<CompareCell> cells;
  std::vector<std::string> inputs;
  std::vector<size_t> first_cell_of;  // by input: of the first estimator; others follow
  for (const std::string& scenario : options.scenarios) {
    const std::vector<Choice> choices = ChoicesOf(scenario, options);
    for (const double distance_m : options.distances_m)
      for (const double milk : options.milk_ml_m3) {
        const size_t first = cells.size();
        for (const auto& [name, with_keys] : choices)
          cells.push_back({.scenario = scenario,
                           .distance_m = distance_m,
                           .milk_ml_m3 = milk,
                           .estimator = name});
        for (int start = 0; start < options.starts; ++start) {
          inputs.push_back(InputOf(choices, cells[first], start, options.frames));
          first_cell_of.push_back(first);
        }
      }
  }
  std::vector<Json> outputs(inputs.size());
  int done = 0;
  const auto take = [&](size_t i, const std::string& output) {
    outputs[i] = report::ParseJson(output, "a start's result");
    if (options.on_progress) options.on_progress(++done, static_cast<int>(inputs.size()));
  };
  const auto pool = farm::MakePool(options.farm, farm::kJobTimeLimit_s, StartWork(options.plugins));
  if (!farm::MapEach(pool.get(), inputs, take, options.stop_requested)) return {};
  for (size_t i = 0; i < outputs.size(); ++i)
    for (size_t e = 0; e < outputs[i].size(); ++e)
      cells[first_cell_of[i] + e].each.push_back(outputs[i][e].get<StartResult>());
  for (CompareCell& cell : cells) Summarise(options, &cell);
  return cells;
}

}  // namespace turbidock::estimators
