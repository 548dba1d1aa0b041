#include "experiments/studies/recognition/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "sim/base/random.h"

namespace turbidock::recognition {
namespace {

// The scenarios of the rows' markers under these assignments.
std::map<MarkerKind, trial::Scenario> ScenariosOf(const std::vector<TableRow>& rows,
                                                  const std::vector<std::string>& assignments) {
  std::map<MarkerKind, trial::Scenario> scenarios;
  for (const TableRow& row : rows)
    if (!scenarios.contains(row.cell.marker))
      scenarios.emplace(row.cell.marker, RecognitionScenario(row.cell.marker, assignments));
  return scenarios;
}

// Evenly over each column's milk.
std::vector<TableRow> ChosenRows(const TableByMarker& tables, double share) {
  std::vector<TableRow> rows;
  for (const auto& [marker, table] : tables) {
    std::map<double, std::vector<TableRow>> columns;
    for (const TableRow& row : table) columns[row.cell.distance_m].push_back(row);
    for (auto& [distance_m, column] : columns) {
      std::sort(column.begin(), column.end(), [](const TableRow& a, const TableRow& b) {
        return a.cell.milk_ml_m3 < b.cell.milk_ml_m3;
      });
      const auto cells = static_cast<double>(column.size());
      const int chosen = std::max(1, static_cast<int>(std::lround(share * cells)));
      for (int i = 0; i < chosen; ++i)
        rows.push_back(column[static_cast<size_t>((i + 0.5) * cells / chosen)]);
    }
  }
  return rows;
}

// The problem as pagmo sees it: places in [0, 1] in, misfit out.
struct TableFit {
  std::function<double(const std::vector<double>&)> misfit;
  size_t dimension = 0;

  pagmo::vector_double fitness(const pagmo::vector_double& places) const {
    return {misfit(places)};
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {pagmo::vector_double(dimension, 0.0), pagmo::vector_double(dimension, 1.0)};
  }
};

struct Stopped {};

// F of a search that knows where the marker is has settled then.
constexpr double kSettle_s = 1;

}  // namespace

void FreeParameter::Check(const std::string& path) const {
  if (!(low < high)) throw ConfigError(path + ".high", FormatNumber(high) + " must be > low");
  if (logarithmic && !(low > 0))
    throw ConfigError(path + ".low", FormatNumber(low) + " must be > 0 with logarithmic");
  if (!(low <= start && start <= high))
    throw ConfigError(path + ".start", FormatNumber(start) + " must lie from low to high");
}

double FreeParameter::ValueAt(double place) const {
  const double value = logarithmic ? low * std::pow(high / low, place) : low + (high - low) * place;
  return integer ? std::round(value) : value;
}

double FreeParameter::PlaceOf(double value) const {
  const double place =
      logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return std::clamp(place, 0.0, 1.0);
}

std::string FreeParameter::Assignment(double value) const {
  return fmt::format("{}={:.5g}", key, value);
}

void CalibrationPlan::Check(const std::string& path) const {
  if (parameters.empty())
    throw ConfigError(Dotted(path, "parameters"), "there is nothing to calibrate");
}

std::vector<double> CalibrationPlan::Start() const {
  std::vector<double> values;
  for (const FreeParameter& p : parameters) values.push_back(p.start);
  return values;
}

std::vector<std::string> CalibrationPlan::Assignments(const std::vector<double>& values) const {
  std::vector<std::string> assignments;
  for (size_t i = 0; i < parameters.size(); ++i)
    assignments.push_back(parameters[i].Assignment(values[i]));
  return assignments;
}

CalibrationPlan LoadCalibrationPlan(const std::string& path) {
  return config::LoadLayers<CalibrationPlan>({path}, {});
}

CalibrationExperiment::CalibrationExperiment(const CalibrationPlan& plan,
                                             const TableByMarker& tables)
    : seconds_(plan.seconds),
      rows_(ChosenRows(tables, plan.cell_share)),
      recognition_(ScenariosOf(rows_, plan.Assignments(plan.Start())), CellsOf(rows_)) {
  // what the search will write can be read
  trial::Scenario scenario;
  config::ReadFields(config::ParseYaml(CalibratedYaml(plan, plan.Start()), "what calibrate writes"),
                     &scenario, nullptr);
}

double Misfit(const TableComparison& comparison) {
  // what is accepted
  constexpr double kRmse = 0.07, kOtherArea = 0.10, kLoss = 0.12;
  constexpr double kNoCrossing = 3;  // in units of kLoss
  const auto square = [](double x) { return x * x; };
  double loss = 0;
  int losses = 0;
  for (const auto& [distance_m, milk] : comparison.loss_by_distance_m) {
    if (!milk.reference_ml_m3) continue;
    loss += square(milk.ratio() ? (*milk.ratio() - 1) / kLoss : kNoCrossing);
    ++losses;
  }
  return std::sqrt((square(comparison.rmse / kRmse) +
                    square((1 - comparison.area_agreement) / kOtherArea) +
                    (losses > 0 ? loss / losses : 0)) /
                   (losses > 0 ? 3 : 2));
}

std::vector<CellResult> CalibrationExperiment::Run(const std::vector<std::string>& assignments,
                                                   const farm::ForkMapOptions& run) {
  recognition_.set_scenarios(ScenariosOf(rows_, assignments));
  return recognition_.Run(
      {.seconds = seconds_, .settle_s = kSettle_s, .suggest_truth = true, .run = run});
}

double CalibrationExperiment::MisfitOf(const std::vector<CellResult>& results) const {
  std::map<MarkerKind, std::pair<std::vector<CellResult>, std::vector<TableRow>>> by_marker;
  for (size_t i = 0; i < rows_.size(); ++i) {
    auto& [cells, rows] = by_marker[rows_[i].cell.marker];
    cells.push_back(results[i]);
    rows.push_back(rows_[i]);
  }
  double sum = 0;
  for (const auto& [marker, one] : by_marker) {
    const double misfit = Misfit(Compare(one.first, one.second));
    sum += misfit * misfit;
  }
  return std::sqrt(sum / static_cast<double>(by_marker.size()));
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

CalibrationResult Calibrate(const CalibrationPlan& plan, const CalibrationOptions& options,
                            CalibrationExperiment* experiment) {
  const size_t n = plan.parameters.size();
  CalibrationResult result{.misfit = std::numeric_limits<double>::infinity()};
  std::vector<double> best_places(n);
  for (size_t i = 0; i < n; ++i)
    best_places[i] = plan.parameters[i].PlaceOf(plan.parameters[i].start);
  const int size = std::max(5, 4 + static_cast<int>(3 * std::log(static_cast<double>(n))));
  const bool searches = options.generations > 0;
  const int planned = (searches ? size * (1 + options.generations) : 1) + 2 * static_cast<int>(n);
  int done = 0;
  const auto misfit_at = [&](const std::vector<double>& places) {
    std::vector<double> values(n);
    for (size_t i = 0; i < n; ++i) values[i] = plan.parameters[i].ValueAt(places[i]);
    const std::vector<CellResult> results =
        experiment->Run(plan.Assignments(values),
                        {.workers = options.workers, .stop_requested = options.stop_requested});
    if (results.empty()) throw Stopped();
    const double misfit = experiment->MisfitOf(results);
    if (options.on_progress) options.on_progress(++done, planned, std::min(misfit, result.misfit));
    return misfit;
  };
  const auto evaluate = [&](const std::vector<double>& places) {
    const double misfit = misfit_at(places);
    ++result.evaluations;
    if (misfit < result.misfit) {
      result.misfit = misfit;
      best_places = places;
    }
    return misfit;
  };

  const std::vector<double> places = best_places;
  try {
    const pagmo::problem problem(TableFit{evaluate, n});
    pagmo::population population(problem, 0, options.seed);
    population.push_back(places);
    if (searches) {
      // the first generation about the start, from which CMA-ES takes its mean
      Rng rng(options.seed, 0);
      for (int i = 1; i < size; ++i) {
        std::vector<double> near = places;
        for (double& place : near) place = std::clamp(place + plan.spread * rng.Normal(), 0.0, 1.0);
        population.push_back(near);
      }
      pagmo::cmaes search(static_cast<unsigned>(options.generations), -1, -1, -1, -1,
                          /*sigma0=*/plan.spread, 1e-6, 1e-6, /*memory=*/false,
                          /*force_bounds=*/true, options.seed);
      search.evolve(population);
    }
    for (size_t i = 0; i < n; ++i) {
      std::pair<double, double> beside;
      for (const bool higher : {false, true}) {
        std::vector<double> moved = best_places;
        moved[i] = std::clamp(moved[i] + (higher ? 0.05 : -0.05), 0.0, 1.0);
        (higher ? beside.second : beside.first) = misfit_at(moved);
      }
      result.misfit_beside.push_back(beside);
    }
  } catch (const Stopped&) {
  }
  for (size_t i = 0; i < n; ++i)
    result.values.push_back(plan.parameters[i].ValueAt(best_places[i]));
  return result;
}

}  // namespace turbidock::recognition
