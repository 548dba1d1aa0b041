#include "experiments/studies/estimators/compare_estimators.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <map>

#include "experiments/report/json.h"
#include "experiments/system/build_info.h"
#include "experiments/trial/world.h"

namespace turbidock::estimators {
namespace {

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
    const std::clock_t start = std::clock();
    estimate = estimator->Update(image);
    times_s.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  const Pose& X_HM = snapshot.true_X_HM;
  return {.seed = scenario.seed,
          .is_sure = estimate.fitness >= scenario.procedure.lost_fitness,
          .error_m = (estimate.X_HM.p - X_HM.p).norm(),
          .rotation_rad = AngleBetween(estimate.X_HM.q, X_HM.q),
          .fitness = estimate.fitness,
          .frame_s = *statistics::Median(times_s)};
}

// The scenario with each estimator that is compared.
std::vector<trial::Scenario> WithEstimators(const std::string& scenario,
                                            const CompareOptions& options) {
  std::vector<trial::Scenario> scenarios;
  const auto add = [&](const std::vector<std::string>& assignments) {
    scenarios.push_back(trial::LoadScenario(scenario, assignments, "", options.plugins));
    if (scenarios.back().pose_source != trial::PoseSource::kCameras)
      throw ConfigError("pose_source", "must be cameras: estimators are compared on images");
  };
  if (options.estimators.empty()) add(options.assignments);
  for (const std::string& name : options.estimators) {
    std::vector<std::string> assignments = options.assignments;
    assignments.push_back("pose_estimator=" + name);
    add(assignments);
  }
  return scenarios;
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
  cell->right = 0;
  for (const StartResult& one : cell->each) {
    times_s.push_back(one.frame_s);
    if (!one.is_sure) continue;
    errors_m.push_back(one.error_m);
    rotations_rad.push_back(one.rotation_rad);
    cell->right += units::MmFromM(one.error_m) <= options.right_mm &&
                   units::DegFromRad(one.rotation_rad) <= options.right_deg;
  }
  const auto sure = static_cast<int>(errors_m.size());
  cell->starts = static_cast<int>(cell->each.size());
  cell->wrong_and_sure = sure - cell->right;
  cell->not_found = cell->starts - sure;
  cell->right_interval = statistics::WilsonInterval(cell->right, cell->starts);
  cell->wrong_and_sure_interval = statistics::WilsonInterval(cell->wrong_and_sure, cell->starts);
  cell->error_median_m = statistics::Median(errors_m);
  cell->rotation_median_rad = statistics::Median(rotations_rad);
  cell->frame_s = statistics::Median(times_s);
}

std::vector<CompareCell> CompareEstimators(const CompareOptions& options) {
  const auto starts = static_cast<size_t>(options.starts);  // of each cell
  std::vector<CompareCell> cells;
  std::vector<std::string> inputs;
  for (const std::string& name : options.scenarios) {
    const std::vector<trial::Scenario> scenarios = WithEstimators(name, options);
    for (const double distance_mm : options.distances_mm)
      for (const double milk : options.milk_ml_m3)
        for (trial::Scenario one : scenarios) {
          cells.push_back({.scenario = name,
                           .distance_mm = distance_mm,
                           .milk_ml_m3 = milk,
                           .estimator = one.estimator_name(),
                           .each = std::vector<StartResult>(starts)});
          one.light.water.milk_ml_m3 = milk;
          for (size_t start = 0; start < starts; ++start, ++one.seed)
            inputs.push_back(report::JsonLine(
                Start{trial::SaveScenario(one), units::MFromMm(distance_mm), options.frames}));
        }
  }
  int done = 0;
  const auto take = [&](size_t i, const std::string& output) {
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

report::Report ReportOf(const std::vector<CompareCell>& cells) {
  report::Report report{.kind = "estimators",
                        .title = "Estimators from cold starts",
                        .build = system::VersionAndCommit()};
  report::Table table({"<scenario", "mm", "ml/m³", "<estimator", "right", "95 %", "wrong and sure",
                       "not found", "median error, mm", "median error, °", "ms/frame"});
  const auto scaled = [](const std::optional<double>& value, double unit, int digits) {
    return value ? report::Fixed(unit * *value, digits) : "-";
  };
  std::map<std::string, CompareCell> sums;  // by estimator
  for (const CompareCell& cell : cells) {
    for (auto count : {&CompareCell::starts, &CompareCell::right, &CompareCell::wrong_and_sure,
                       &CompareCell::not_found})
      sums[cell.estimator].*count += cell.*count;
    table.Row({cell.scenario, FormatNumber(cell.distance_mm), FormatNumber(cell.milk_ml_m3),
               cell.estimator, fmt::format("{}/{}", cell.right, cell.starts),
               fmt::format("{:.2f}..{:.2f}", cell.right_interval.low, cell.right_interval.high),
               report::Cell(std::to_string(cell.wrong_and_sure),
                            cell.wrong_and_sure > 0 ? report::Tone::kBad : report::Tone::kNone),
               std::to_string(cell.not_found), scaled(cell.error_median_m, units::MmFromM(1), 1),
               scaled(cell.rotation_median_rad, units::kDegPerRad, 2),
               scaled(cell.frame_s, 1000, 2)});
  }
  for (const auto& [name, sum] : sums)
    report.facts.push_back(
        {name, fmt::format("{} of {} right", sum.right, sum.starts),
         fmt::format("{} wrong and sure, {} not found", sum.wrong_and_sure, sum.not_found)});
  report.sections = {{.title = "Cells",
                      .note = "F: how well the pixels agree with the marker at the pose found, 1 "
                              "at best. Sure: F at least procedure.lost_fitness. Errors are of the "
                              "estimates that are sure; intervals 95 %.",
                      .table = table}};
  return report;
}

}  // namespace turbidock::estimators
