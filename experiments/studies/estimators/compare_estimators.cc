#include "experiments/studies/estimators/compare_estimators.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include "experiments/batch/job_options.h"
#include "experiments/report/json.h"
#include "experiments/trial/world.h"

namespace turbidock::estimators {
namespace {

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

// The scenario with each estimator that is compared.
std::vector<trial::Scenario> WithEstimators(const std::string& scenario,
                                            const CompareOptions& options) {
  std::vector<trial::Scenario> scenarios;
  const bool has_names = !options.estimators.empty();
  for (const std::string& name : has_names ? options.estimators : std::vector{std::string()}) {
    std::vector<std::string> assignments = options.assignments;
    if (has_names) assignments.push_back("pose_estimator=" + name);
    scenarios.push_back(trial::LoadScenario(scenario, assignments, "", options.plugins));
    if (scenarios.back().pose_source != trial::PoseSource::kCameras)
      throw ConfigError("pose_source", "must be cameras: estimators are compared on images");
  }
  return scenarios;
}

// A start as the input of a task.
struct Start {
  std::string scenario;  // its text, with estimator, milk and seed
  double distance_m = 0;
  int frames = 0;

  TURBIDOCK_FIELDS(scenario, distance_m, frames)
};

StartResult Run(const trial::Scenario& scenario, double distance_m, int frames) {
  trial::World world(scenario, {});
  Rng rng = world.seeds().Stream("compare");
  world.PlaceVehicle(DrawPose(distance_m, &rng).Inverse());
  trial::Snapshot snapshot;
  world.Capture(&snapshot);
  const std::string name = scenario.estimator_name();
  const auto estimator = scenario.MakeEstimator(name, world.seeds().Stream("vision." + name));
  PoseEstimate estimate;
  std::vector<double> times_s;
  for (int frame = 0; frame < frames; ++frame) {
    snapshot.time_s = scenario.image_clock().TimeOfFrame(frame);
    StereoImage image;
    image.frame = frame;
    world.RenderImages(snapshot, frame, std::nullopt, nullptr, &image);
    const double start_s = ProcessorTime_s();
    estimate = estimator->Update(image);
    times_s.push_back(ProcessorTime_s() - start_s);
  }
  const Pose& X_HM = snapshot.true_X_HM;
  return {.seed = scenario.seed,
          .is_sure = estimate.fitness >= scenario.procedure.lost_fitness,
          .error_m = (estimate.X_HM.p - X_HM.p).norm(),
          .rotation_rad = AngleBetween(estimate.X_HM.q, X_HM.q),
          .fitness = estimate.fitness,
          .frame_s = *statistics::Median(times_s)};
}

}  // namespace

batch::Work StartWork(const trial::Plugins& plugins) {
  return {"cold start", [plugins](const std::string& input) {
            const auto start = report::ParseJson(input, "a start").get<Start>();
            return report::JsonLine(
                Run(trial::ParseScenario(start.scenario, "a start's scenario", plugins),
                    start.distance_m, start.frames));
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
    const bool is_right = units::MmFromM(one.error_m) <= options.right_mm &&
                          units::DegFromRad(one.rotation_rad) <= options.right_deg;
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
  std::vector<std::string> inputs;  // so many starts of each cell
  for (const std::string& name : options.scenarios) {
    const std::vector<trial::Scenario> scenarios = WithEstimators(name, options);
    for (const double distance_mm : options.distances_mm)
      for (const double milk : options.milk_ml_m3)
        for (trial::Scenario one : scenarios) {
          const double distance_m = units::MFromMm(distance_mm);
          cells.push_back({.scenario = name,
                           .distance_m = distance_m,
                           .milk_ml_m3 = milk,
                           .estimator = one.estimator_name()});
          one.light.water.milk_ml_m3 = milk;
          for (int start = 0; start < options.starts; ++start, ++one.seed)
            inputs.push_back(
                report::JsonLine(Start{trial::SaveScenario(one), distance_m, options.frames}));
        }
  }
  for (CompareCell& cell : cells) cell.each.resize(static_cast<size_t>(options.starts));
  int done = 0;
  const auto take = [&](size_t i, const std::string& output) {
    const size_t starts = cells.front().each.size();
    cells[i / starts].each[i % starts] =
        report::ParseJson(output, "a start's result").get<StartResult>();
    if (options.on_progress) options.on_progress(++done, static_cast<int>(inputs.size()));
  };
  const auto pool =
      batch::MakePool(options.jobs, batch::kJobTimeLimit_s, StartWork(options.plugins));
  if (!batch::MapEach(pool.get(), inputs, take, options.stop_requested)) return {};
  for (CompareCell& cell : cells) Summarise(options, &cell);
  return cells;
}

}  // namespace turbidock::estimators
