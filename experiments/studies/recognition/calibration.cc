#include "experiments/studies/recognition/calibration.h"

#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "experiments/batch/result_store.h"
#include "experiments/batch/runner.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/search/optimiser.h"
#include "experiments/system/build_info.h"
#include "experiments/system/plain_text.h"
#include "sim/base/random.h"
#include "sim/base/units.h"
#include "vision/fitness.h"
#include "vision/hue_labels.h"

namespace turbidock::recognition {
namespace {

// How far a run may be from what is known: misfit 1. What a run that has nothing to measure counts
// as.
constexpr double kAcceptedRmse[] = {0.05, 0.075};  // by marker; the passive one's F scatters more
constexpr double kAcceptedOtherArea = 0.08, kAcceptedLoss = 0.1, kAcceptedLostFitness = 0.03;
// The published deviation has lamps, milk and a vehicle that drift in it, which are not in the
// model: noise may do less.
constexpr double kLargestStd = 0.06;
constexpr double kMisfitOfNothing = 3;

// ----------------------------------------------------------------------------- F near the true
// pose

// What is looked at of the images: a ball about the marker that holds its balls and this margin.
constexpr double kMargin_m = 0.05;

StereoRegion RegionOf(const trial::FixedView& view, const vision::MarkerParams& marker) {
  double reach_m = 0;
  for (const vision::BallParams& ball : marker.balls)
    reach_m = std::max(reach_m, ball.p_MQ_m.norm() + ball.radius_m + kMargin_m);
  return view.rig.Each([&](const MountedCamera& camera) {
    const auto [u, v, reach_px] =
        vision::ProjectBall(camera, camera.X_HC.Inverse() * view.X_HM.p, reach_m);
    return PixelRegion{std::max(0, static_cast<int>(u - reach_px)),
                       std::max(0, static_cast<int>(v - reach_px)),
                       std::min(camera.width_px, static_cast<int>(u + reach_px)),
                       std::min(camera.height_px, static_cast<int>(v + reach_px))};
  });
}

// The true pose, some within a few pixels of it, and many within the size of the marker.
std::vector<Pose> PosesAbout(const Pose& X_HM, double focal_px, Rng rng) {
  const double distance_m = X_HM.p.x(), px_m = distance_m / focal_px;
  const struct {
    int count;
    double across_m, along_m, eps;
  } clouds[] = {{150, px_m, 0.004, 0.01},
                {120, 2 * px_m, 0.01, 0.03},
                {300, 20 * px_m, 0.08 * distance_m, 0.06}};
  std::vector<Pose> poses = {X_HM};
  for (const auto& cloud : clouds)
    for (int i = 0; i < cloud.count; ++i) {
      const auto draw = [&](double deviation) { return deviation * rng.Normal(); };
      // in braces, for the order of arguments in parentheses is the compiler's
      const Eigen::Vector3d offset{draw(cloud.along_m), draw(cloud.across_m), draw(cloud.across_m)};
      const Eigen::Vector3d eps{draw(cloud.eps), draw(cloud.eps), draw(cloud.eps)};
      const Eigen::Quaterniond turn(std::sqrt(std::max(0.0, 1 - eps.squaredNorm())), eps.x(),
                                    eps.y(), eps.z());
      poses.push_back({X_HM.q * turn.normalized(), X_HM.p + offset});
    }
  return poses;
}

}  // namespace

CellResult RunNearTruth(const trial::FixedView& view, const light::Water& water,
                        const trial::Scenario& scenario, const RecognitionCell& cell, int frames) {
  const StereoRegion region = RegionOf(view, scenario.marker);
  const std::vector<Pose> X_HM =
      PosesAbout(view.X_HM, view.rig.left.fx_px, SeedsOf(scenario, cell).Stream("near_truth"));
  camera::StereoCamera cameras = CamerasOf(view, water, scenario, cell);
  vision::HueLabeller labeller(scenario.hue, scenario.marker);
  Stereo<Image1u8> labels;
  StereoImage seen;
  std::vector<double> fitness(X_HM.size());
  std::vector<float> best_of_frames;
  for (int frame = 0; frame < frames; ++frame) {
    cameras.ExposeHeld(region, frame, &seen);
    for (const Side side : kSides) labeller.Label(seen[side], region[side], &labels[side]);
    vision::Fitness evaluation(scenario.marker, view.rig, labels);
    evaluation.Confine(region);
    evaluation.EvaluateAll(X_HM, fitness);
    best_of_frames.push_back(static_cast<float>(std::ranges::max(fitness)));
  }
  CellResult result{.cell = cell};
  SetFitness(std::move(best_of_frames), &result);
  return result;
}

void FreeParameter::Check(const std::string& path) const {
  if (!(low < high)) throw ConfigError(path + ".high", FormatNumber(high) + " must be > low");
  if (logarithmic && !(low > 0))
    throw ConfigError(path + ".low", FormatNumber(low) + " must be > 0 with logarithmic");
  if (!(low <= start && start <= high))
    throw ConfigError(path + ".start", FormatNumber(start) + " must lie from low to high");
}

double FreeParameter::ValueAt(double place) const {
  return logarithmic ? low * std::pow(high / low, place) : low + (high - low) * place;
}

double FreeParameter::PlaceOf(double value) const {
  const double place =
      logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return std::clamp(place, 0.0, 1.0);
}

void CalibrationPlan::Check(const std::string& path) const {
  if (parameters.empty())
    throw ConfigError(JoinKey(path, "parameters"), "there is nothing to calibrate");
}

std::vector<double> CalibrationPlan::Start() const {
  std::vector<double> values;
  for (const FreeParameter& p : parameters) values.push_back(p.start);
  return values;
}

std::vector<double> CalibrationPlan::ValuesAt(const std::vector<double>& places) const {
  std::vector<double> values;
  for (size_t i = 0; i < parameters.size(); ++i) values.push_back(parameters[i].ValueAt(places[i]));
  return values;
}

std::vector<std::string> CalibrationPlan::Assignments(const std::vector<double>& values) const {
  std::vector<std::string> assignments;
  for (size_t i = 0; i < parameters.size(); ++i) {
    const FreeParameter& p = parameters[i];
    std::vector<double> list = p.ratio;
    for (double& element : list) element *= values[i];
    assignments.push_back(list.empty() ? fmt::format("{}={:.5g}", p.key, values[i])
                                       : fmt::format("{}=[{:.5g}]", p.key, fmt::join(list, ", ")));
  }
  return assignments;
}

CalibrationPlan LoadCalibrationPlan(const std::string& path) {
  return config::LoadLayers<CalibrationPlan>({path}, {});
}

namespace {

// F of an image of the cell; nothing where the values are impossible together.
std::optional<double> FitnessWith(const CalibrationPlan& plan, const std::vector<double>& values,
                                  const RecognitionCell& cell) try {
  const trial::Scenario scenario = RecognitionScenario(cell.marker, plan.Assignments(values));
  const trial::FixedView view = ViewOf(scenario, cell);
  return RunNearTruth(view, WaterOf(view, scenario, cell), scenario, cell, 1).fitness_mean;
} catch (const ConfigError&) {
  return std::nullopt;
}

// A value that the tables or the experiment give, or that is switched off, cannot be found.
void RequireEffects(const CalibrationExperiment& experiment) {
  const CalibrationPlan& plan = experiment.plan;
  const std::vector<double> start = plan.Start();
  for (size_t i = 0; i < start.size(); ++i) {
    const auto changes = [&](const TableRow& row) {
      const auto with = [&](double value) {
        std::vector<double> values = start;
        values[i] = value;
        return FitnessWith(plan, values, row.cell);
      };
      const auto low = with(plan.parameters[i].low), high = with(plan.parameters[i].high);
      return !low || !high || *low != *high;
    };
    if (std::ranges::none_of(experiment.rows, changes))
      throw ConfigError(fmt::format("parameters[{}].key", i),
                        plan.parameters[i].key + " changes nothing that this experiment sees");
  }
}

}  // namespace

CalibrationExperiment ExperimentOf(const CalibrationPlan& plan,
                                   const std::vector<TableRow>& tables) {
  // what the search will set and write can be read
  for (const auto& [marker, name] : EnumNames<MarkerKind>::kNames)
    RecognitionScenario(marker, plan.Assignments(plan.Start()));
  trial::Scenario scenario;
  config::ReadFields(config::ParseYaml(CalibratedYaml(plan, plan.Start()), "what calibrate writes"),
                     &scenario, nullptr);
  std::map<std::pair<MarkerKind, double>, std::vector<TableRow>> columns;
  for (const TableRow& row : tables) columns[{row.cell.marker, row.cell.distance_m}].push_back(row);
  CalibrationExperiment experiment{.plan = plan, .rows = {}};
  for (auto& [place, column] : columns) {
    std::ranges::sort(column, {}, &TableRow::cell);
    const auto cells = static_cast<double>(column.size());
    const int chosen = std::max(1, static_cast<int>(std::lround(plan.cell_share * cells)));
    for (int i = 0; i < chosen; ++i)
      experiment.rows.push_back(column[static_cast<size_t>((i + 0.5) * cells / chosen)]);
    // The search must begin with what can be.
    const RecognitionCell& cell = experiment.rows.back().cell;
    const trial::Scenario start = RecognitionScenario(cell.marker, plan.Assignments(plan.Start()));
    const trial::FixedView view = ViewOf(start, cell);
    CamerasOf(view, WaterOf(view, start, cell), start, cell);
  }
  RequireEffects(experiment);
  return experiment;
}

std::vector<Constraint> TableConstraints(MarkerKind marker, const TableComparison& comparison) {
  std::vector<Constraint> constraints;
  const auto add = [&](const std::string& what, std::optional<double> value, auto&& misfit_of) {
    constraints.push_back({.constraint = fmt::format("{} {}", NameOf(marker), what),
                           .value = value,
                           .misfit = value ? misfit_of(*value) : kMisfitOfNothing});
  };
  const auto within = [](double bound) {
    return [bound](double value) { return std::abs(value) / bound; };
  };
  add("rmse", comparison.rmse, within(kAcceptedRmse[static_cast<size_t>(marker)]));
  add("other area", 1 - comparison.area_agreement, within(kAcceptedOtherArea));
  for (const auto& [distance_m, loss] : comparison.loss_by_distance_m)
    if (loss.reference_ml_m3)
      add(fmt::format("loss at {:g} mm", units::MmFromM(distance_m)), loss.ratio(),
          [](double ratio) { return std::abs(ratio - 1) / kAcceptedLoss; });
  if (comparison.lost_fitness_error)
    add("lost F", comparison.lost_fitness_error, within(kAcceptedLostFitness));
  if (comparison.fitness_std) add("deviation", comparison.fitness_std, within(kLargestStd));
  return constraints;
}

double Misfit(const std::vector<Constraint>& constraints) {
  double squares = 0;
  for (const Constraint& c : constraints) squares += c.misfit * c.misfit;
  return std::sqrt(squares / static_cast<double>(constraints.size()));
}

namespace {

// A marker's cells. Half of the time of a cell went into the water's tables, which are the same at
// every distance.
std::vector<CellResult> RunCellsNearTruth(const trial::Scenario& scenario,
                                          const std::vector<TableRow>& rows,
                                          const CalibrationPlan& plan) {
  std::map<double, trial::FixedView> views;  // by distance
  std::map<double, std::vector<size_t>> rows_by_milk;
  for (size_t i = 0; i < rows.size(); ++i) {
    const RecognitionCell& cell = rows[i].cell;
    rows_by_milk[cell.milk_ml_m3].push_back(i);
    if (!views.contains(cell.distance_m)) views.emplace(cell.distance_m, ViewOf(scenario, cell));
  }
  std::vector<CellResult> results(rows.size());
  for (const auto& [milk_ml_m3, cells] : rows_by_milk) {
    const RecognitionCell& first = rows[cells[0]].cell;
    const light::Water water = WaterOf(views.at(first.distance_m), scenario, first);
    for (const size_t i : cells) {
      const RecognitionCell& cell = rows[i].cell;
      results[i] = RunNearTruth(views.at(cell.distance_m), water, scenario, cell, plan.frames);
    }
  }
  return results;
}

}  // namespace

Evaluation Evaluate(const CalibrationExperiment& experiment,
                    const std::vector<double>& values) try {
  Evaluation evaluation{.values = values};
  for (const auto& kind : EnumNames<MarkerKind>::kNames) {
    const MarkerKind marker = kind.first;
    const trial::Scenario scenario =
        RecognitionScenario(marker, experiment.plan.Assignments(values));
    std::vector<TableRow> rows;
    std::ranges::copy_if(experiment.rows, std::back_inserter(rows),
                         [&](const TableRow& row) { return row.cell.marker == marker; });
    if (rows.empty()) continue;
    const std::vector<CellResult> results = RunCellsNearTruth(scenario, rows, experiment.plan);
    for (const CellResult& result : results) evaluation.fitness.push_back(result.fitness_mean);
    for (const Constraint& c : TableConstraints(marker, *Compare(results, rows)))
      evaluation.constraints.push_back(c);
  }
  evaluation.misfit = Misfit(evaluation.constraints);
  return evaluation;
} catch (const ConfigError&) {
  // Each in its range, but not together: a lamp in the hull.
  return {.values = values, .misfit = kMisfitOfNothing};
}

std::vector<ColumnError> ErrorsByColumn(const CalibrationPlan& plan,
                                        const std::vector<double>& values,
                                        const std::vector<TableRow>& tables,
                                        const std::vector<double>& left_out_m) {
  std::vector<ColumnError> errors;
  for (const auto& kind : EnumNames<MarkerKind>::kNames) {
    std::map<double, std::vector<TableRow>> columns;
    for (const TableRow& row : tables)
      if (row.cell.marker == kind.first) columns[row.cell.distance_m].push_back(row);
    const trial::Scenario scenario = RecognitionScenario(kind.first, plan.Assignments(values));
    for (const auto& [distance_m, rows] : columns) {
      const auto comparison = Compare(RunCellsNearTruth(scenario, rows, plan), rows);
      errors.push_back({.marker = kind.first,
                        .distance_m = distance_m,
                        .left_out = std::ranges::count(left_out_m, distance_m) > 0,
                        .rmse = comparison->rmse,
                        .area_agreement = comparison->area_agreement});
    }
  }
  return errors;
}

std::vector<TableRow> Without(const std::vector<double>& left_out_m,
                              const std::vector<TableRow>& tables) {
  const auto distance_of = [](const TableRow& row) { return row.cell.distance_m; };
  for (const double distance_m : left_out_m)
    if (std::ranges::count(tables, distance_m, distance_of) == 0)
      throw ConfigError(
          fmt::format("--leave-out {:g}: no table has this distance", units::MmFromM(distance_m)));
  std::vector<TableRow> rest;
  std::ranges::copy_if(tables, std::back_inserter(rest), [&](const TableRow& row) {
    return std::ranges::count(left_out_m, row.cell.distance_m) == 0;
  });
  if (rest.empty()) throw ConfigError("--leave-out: no distance is left to calibrate with");
  return rest;
}

batch::Work EvaluationWork() {
  return {"set of values", [](const std::string& input) {
            const report::Json json = report::ParseJson(input, "a set of values");
            return report::JsonLine(
                Evaluate(json["experiment"].get<CalibrationExperiment>(), json["values"]));
          }};
}

std::string CalibratedYaml(const CalibrationPlan& plan, const std::vector<double>& values) {
  YAML::Node root = YAML::LoadFile(config::AssetPath("optics.yaml"));
  for (const std::string& assignment : plan.Assignments(values)) {
    const size_t equals = assignment.find('=');
    // a chain of maps, made as it is followed
    YAML::Node node = root;
    std::string key = assignment.substr(0, equals);
    for (size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.')) {
      node.reset(node[key.substr(0, dot)]);
      key.erase(0, dot + 1);
    }
    const YAML::Node value = YAML::Load(assignment.substr(equals + 1));
    if (const size_t bracket = key.find('['); bracket != std::string::npos)
      node[key.substr(0, bracket)][std::stoul(key.substr(bracket + 1))] = value;
    else
      node[key] = value;
  }
  return YAML::Dump(root) + "\n";
}

namespace {

// All that an evaluation follows from, but for its values. A longer search goes on with a shorter
// one.
batch::StoreHeader HeaderOf(const CalibrationExperiment& experiment, uint32_t seed) {
  std::string plan = config::SaveYaml(experiment.plan) + fmt::format("seed: {}\n", seed);
  plan += "rows:\n";
  for (const TableRow& row : experiment.rows) plan += "  - " + report::JsonLine(row) + "\n";
  std::map<std::string, trial::ModelFile> files;
  for (const auto& [marker, name] : EnumNames<MarkerKind>::kNames) {
    const trial::Scenario start =
        RecognitionScenario(marker, experiment.plan.Assignments(experiment.plan.Start()));
    plan += std::string(name) + ":\n" + system::Indented(trial::SaveScenario(start), "  ");
    for (const trial::ModelFile& file : trial::ModelFilesOf(start)) files[file.file] = file;
  }
  return {.kind = "calibrate",
          .plan = plan + batch::ModelFilesText(files),
          .build = system::BuildId(),
          .shard = {},
          .trials = 0,
          .keys = {}};
}

}  // namespace

CalibrationResult Calibrate(const CalibrationOptions& options,
                            const CalibrationExperiment& experiment) {
  const CalibrationPlan& plan = experiment.plan;
  search::Candidate start;
  for (const FreeParameter& p : plan.parameters) start.push_back(p.PlaceOf(p.start));
  const auto n = static_cast<double>(start.size());
  const search::OptimiserParams optimiser{
      .population = std::max(5, 4 + static_cast<int>(3 * std::log(n))),
      .generations = options.generations,
      .initial_step = plan.spread};
  std::optional<batch::ResultStore> store;
  if (!options.file.empty())
    store.emplace(batch::ResultStore::Write(options.file, HeaderOf(experiment, options.seed)));
  const auto pool = batch::MakePool(options.jobs, batch::kJobTimeLimit_s, EvaluationWork());
  CalibrationResult result{.best = {.values = plan.Start()}};
  int done = 0;
  const auto evaluate = [&](int, const std::vector<search::Candidate>& candidates) {
    std::vector<std::string> inputs;
    inputs.reserve(candidates.size());
    for (const search::Candidate& places : candidates)
      inputs.push_back(
          report::JsonLine({{"experiment", experiment}, {"values", plan.ValuesAt(places)}}));
    std::vector<std::optional<Evaluation>> evaluations(inputs.size());
    double best = result.best.misfit;
    const auto take = [&](size_t i, const std::string& output) {
      evaluations[i] = report::ParseJson(output, "an evaluation").get<Evaluation>();
      best = std::min(best, evaluations[i]->misfit);
      if (options.on_progress)
        options.on_progress(++done, 1 + optimiser.population * optimiser.generations, best);
    };
    const int64_t first = result.evaluations;
    const bool is_whole = batch::MapEachKept(pool.get(), store ? &*store : nullptr, first, inputs,
                                             take, options.stop_requested);
    std::vector<double> misfits;
    for (const std::optional<Evaluation>& one : evaluations) {
      if (!one) continue;  // prevented by a stop
      ++result.evaluations;
      misfits.push_back(one->misfit);
      if (one->misfit < result.best.misfit) result.best = *one;
    }
    if (!is_whole) throw batch::Stopped();
    return misfits;
  };

  try {
    search::Optimise(optimiser, options.seed, start, evaluate);
    result.is_complete = true;
  } catch (const batch::Stopped&) {
  }
  return result;
}

namespace {

report::Section ColumnSection(const std::vector<ColumnError>& columns) {
  report::Table table({"<marker", "distance, mm", "<search", "error of F", "same Area, %"});
  for (const ColumnError& c : columns)
    table.Row({NameOf(c.marker), report::Fixed(units::MmFromM(c.distance_m), 0),
               c.left_out ? "left out" : "took part", report::Fixed(c.rmse, 3),
               report::Fixed(100 * c.area_agreement, 0)});
  return {.title = "By distance",
          .note = "Root-mean-square error of F, of all cells, near the true pose.",
          .table = table};
}

}  // namespace

report::Report ReportOf(const CalibrationPlan& plan, const CalibrationResult& result) {
  using report::Fixed;
  const Evaluation& best = result.best;
  report::Table parameters({"<parameter", "value", "range"});
  for (size_t i = 0; i < plan.parameters.size(); ++i) {
    const FreeParameter& p = plan.parameters[i];
    parameters.Row(
        {p.key, fmt::format("{:.5g}", best.values[i]), fmt::format("{:g} to {:g}", p.low, p.high)});
  }
  report::Table constraints({"<constraint", "value", "misfit"});
  for (const auto& [constraint, value, misfit] : best.constraints)
    constraints.Row(
        {constraint, Fixed(value, 3),
         report::Cell(Fixed(misfit, 2), misfit > 1 ? report::Tone::kBad : report::Tone::kNone)});
  const std::string confirm = fmt::format(
      "turbidock recognize --marker passive --table assets/recognition_passive.csv --set '{}'",
      fmt::join(plan.Assignments(best.values), "' --set '"));
  report::Report report{
      .kind = "calibration",
      .title = "Calibration of water, lights and cameras",
      .build = system::VersionAndCommit(),
      .facts = {{"misfit", Fixed(best.misfit, 3), "1: as far off as is accepted"},
                {"evaluations", std::to_string(result.evaluations)}},
      .sections = {{.title = "Parameters", .table = parameters},
                   {.title = "Constraints",
                    .note = "Of the searched cells, F near the true pose.",
                    .table = constraints,
                    .commands = {{"the whole experiment, whose search knows nothing", confirm}}}}};
  if (!result.columns.empty()) report.sections.push_back(ColumnSection(result.columns));
  if (!result.is_complete) report.missing = {"It was stopped: the best so far."};
  return report;
}

report::Json ResultJson(const CalibrationPlan& plan, const CalibrationResult& result) {
  report::Json parameters = plan.parameters;
  for (size_t i = 0; i < parameters.size(); ++i) parameters[i]["value"] = result.best.values[i];
  return {{"parameters", parameters},
          {"misfit", result.best.misfit},
          {"evaluations", result.evaluations},
          {"constraints", result.best.constraints},
          {"columns", result.columns}};
}

}  // namespace turbidock::recognition
