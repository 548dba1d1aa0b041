#include "experiments/studies/recognition/calibration.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/studies/recognition/look.h"
#include "sim/base/random.h"
#include "sim/base/units.h"

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

// What a run that has nothing to measure counts as.
constexpr double kMisfitOfNothing = 3;

// Of a value that is to reach at least a bound: 1 there, 2 at zero.
double ShortOf(double bound, double value) { return std::max(0.0, 2 - value / bound); }

// The pictures that are described in print: the balls in clear water; the passive marker's last.
std::vector<RecognitionCell> PicturesOf(const TableByMarker& tables) {
  constexpr double kClearView_m = 0.6;
  std::vector<RecognitionCell> cells;
  for (const auto& [marker, table] : tables) {
    cells.push_back({marker, 0, kClearView_m});
    if (marker != MarkerKind::kPassive) continue;
    std::map<double, double> last_milk;  // by distance
    for (const TableRow& row : table) {
      double& milk = last_milk[row.cell.distance_m];
      milk = std::max(milk, row.cell.milk_ml_m3);
    }
    for (const auto& [distance_m, milk] : last_milk) cells.push_back({marker, milk, distance_m});
  }
  return cells;
}

// Whether a is at least as good as b in every constraint.
bool Dominates(const Evaluation& a, const Evaluation& b) {
  for (size_t i = 0; i < a.constraints.size(); ++i)
    if (a.constraints[i].misfit > b.constraints[i].misfit) return false;
  return true;
}

void AddToFront(const Evaluation& evaluation, std::vector<Evaluation>* front) {
  for (const Evaluation& other : *front)
    if (Dominates(other, evaluation)) return;
  std::erase_if(*front, [&](const Evaluation& other) { return Dominates(evaluation, other); });
  front->push_back(evaluation);
}

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
    throw ConfigError(JoinKey(path, "parameters"), "there is nothing to calibrate");
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
    : accepted_(plan.accepted),
      rows_(ChosenRows(tables, plan.cell_share)),
      recognition_(ScenariosOf(rows_, plan.Assignments(plan.Start())), CellsOf(rows_)),
      near_truth_(recognition_, plan.frames),
      pictures_(ScenariosOf(rows_, plan.Assignments(plan.Start())), PicturesOf(tables)) {
  // what the search will write can be read
  trial::Scenario scenario;
  config::ReadFields(config::ParseYaml(CalibratedYaml(plan, plan.Start()), "what calibrate writes"),
                     &scenario, nullptr);
}

std::vector<Constraint> TableConstraints(MarkerKind marker, const TableComparison& comparison,
                                         const AcceptedErrors& accepted) {
  std::vector<Constraint> constraints;
  const auto add = [&](const std::string& what, std::optional<double> value, auto&& misfit_of) {
    constraints.push_back({.name = fmt::format("{} {}", NameOf(marker), what),
                           .value = value,
                           .misfit = value ? misfit_of(*value) : kMisfitOfNothing});
  };
  const auto within = [](double bound) {
    return [bound](double value) { return std::abs(value) / bound; };
  };
  add("rmse", comparison.rmse,
      within(marker == MarkerKind::kActive ? accepted.rmse_active : accepted.rmse_passive));
  add("other area", 1 - comparison.area_agreement, within(accepted.other_area));
  for (const auto& [distance_m, loss] : comparison.loss_by_distance_m)
    if (loss.reference_ml_m3)
      add(fmt::format("loss at {:g} mm", units::MmFromM(distance_m)), loss.ratio(),
          [&](double ratio) { return std::abs(ratio - 1) / accepted.loss; });
  if (comparison.lost_fitness_error)
    add("lost F", comparison.lost_fitness_error, within(accepted.lost_fitness));
  if (comparison.rise)
    add("rise", comparison.rise, [&](double rise) { return ShortOf(accepted.rise, rise); });
  if (comparison.fitness_std)
    add("deviation", comparison.fitness_std, [&](double deviation) {
      return std::max(ShortOf(accepted.least_std, deviation), deviation / accepted.largest_std);
    });
  return constraints;
}

double Misfit(const std::vector<Constraint>& constraints) {
  double squares = 0;
  for (const Constraint& c : constraints) squares += c.misfit * c.misfit;
  return std::sqrt(squares / static_cast<double>(constraints.size()));
}

std::vector<CellResult> CalibrationExperiment::Run(const std::vector<std::string>& assignments,
                                                   const farm::ForkMapOptions& run) {
  recognition_.set_scenarios(ScenariosOf(rows_, assignments));
  pictures_.set_scenarios(ScenariosOf(rows_, assignments));
  near_truth_.Light();
  return MapCells(
      recognition_.cells(), [&](size_t i) { return near_truth_.RunCell(i); }, run);
}

std::vector<Constraint> CalibrationExperiment::ConstraintsOf(
    const std::vector<CellResult>& results) const {
  std::map<MarkerKind, std::pair<std::vector<CellResult>, std::vector<TableRow>>> by_marker;
  for (size_t i = 0; i < rows_.size(); ++i) {
    auto& [cells, rows] = by_marker[rows_[i].cell.marker];
    cells.push_back(results[i]);
    rows.push_back(rows_[i]);
  }
  std::vector<Constraint> constraints = PictureConstraints();
  for (const auto& [marker, one] : by_marker)
    for (Constraint& c : TableConstraints(marker, Compare(one.first, one.second), accepted_))
      constraints.push_back(std::move(c));
  return constraints;
}

std::vector<Constraint> CalibrationExperiment::PictureConstraints() const {
  std::vector<Constraint> constraints;
  for (const RecognitionCell& cell : pictures_.cells()) {
    const trial::Scenario& scenario = pictures_.scenario(cell.marker);
    const Look look = LookOf(pictures_.Image(cell, 0).left, scenario.rig.MakeRig().left,
                             scenario.marker, Pose::Translation(cell.distance_m, 0, 0));
    const auto add = [&](const char* what, double value, double misfit) {
      constraints.push_back({fmt::format("{} {} at {:g} mm", NameOf(cell.marker), what,
                                         units::MmFromM(cell.distance_m)),
                             value, misfit});
    };
    if (cell.milk_ml_m3 == 0) {
      add("ball", look.ball_dn, ShortOf(accepted_.ball_dn, look.ball_dn));
    } else {
      add("white", look.brightness_dn, ShortOf(accepted_.white_dn, look.brightness_dn));
      add("saturation", look.saturation, look.saturation / accepted_.white_saturation);
    }
  }
  return constraints;
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

std::vector<Pull> PullsOf(const CalibrationResult& result) {
  std::vector<Pull> pulls;
  const std::vector<Constraint>& best = result.best.constraints;
  for (size_t i = 0; i < best.size(); ++i) {
    const auto least = std::min_element(result.front.begin(), result.front.end(),
                                        [&](const Evaluation& a, const Evaluation& b) {
                                          return a.constraints[i].misfit < b.constraints[i].misfit;
                                        });
    Pull pull{best[i].name, best[i].misfit, least->constraints[i].misfit, "", 0};
    double most_worse = 0;
    for (size_t j = 0; j < best.size(); ++j) {
      const double worse = least->constraints[j].misfit - best[j].misfit;
      if (worse <= most_worse) continue;
      most_worse = worse;
      pull.against = best[j].name;
      pull.against_misfit = least->constraints[j].misfit;
    }
    pulls.push_back(std::move(pull));
  }
  return pulls;
}

CalibrationResult Calibrate(const CalibrationPlan& plan, const CalibrationOptions& options,
                            CalibrationExperiment* experiment) {
  const size_t n = plan.parameters.size();
  CalibrationResult result{.best = {.values = plan.Start(), .constraints = {}},
                           .misfit = std::numeric_limits<double>::infinity()};
  std::vector<double> best_places(n);
  for (size_t i = 0; i < n; ++i)
    best_places[i] = plan.parameters[i].PlaceOf(plan.parameters[i].start);
  const int size = std::max(5, 4 + static_cast<int>(3 * std::log(static_cast<double>(n))));
  const bool searches = options.generations > 0;
  const int planned = (searches ? size * (1 + options.generations) : 1) + 2 * static_cast<int>(n);
  int done = 0;
  const auto evaluation_at = [&](const std::vector<double>& places) {
    Evaluation evaluation{.values = std::vector<double>(n), .constraints = {}};
    for (size_t i = 0; i < n; ++i) evaluation.values[i] = plan.parameters[i].ValueAt(places[i]);
    const std::vector<CellResult> results =
        experiment->Run(plan.Assignments(evaluation.values),
                        {.workers = options.workers, .stop_requested = options.stop_requested});
    if (results.empty()) throw Stopped();
    evaluation.constraints = experiment->ConstraintsOf(results);
    if (options.on_progress)
      options.on_progress(++done, planned, std::min(Misfit(evaluation.constraints), result.misfit));
    return evaluation;
  };
  const auto evaluate = [&](const std::vector<double>& places) {
    const Evaluation evaluation = evaluation_at(places);
    const double misfit = Misfit(evaluation.constraints);
    ++result.evaluations;
    AddToFront(evaluation, &result.front);
    if (misfit < result.misfit) {
      result.misfit = misfit;
      result.best = evaluation;
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
        (higher ? beside.second : beside.first) = Misfit(evaluation_at(moved).constraints);
      }
      result.misfit_beside.push_back(beside);
    }
  } catch (const Stopped&) {
  }
  return result;
}

}  // namespace turbidock::recognition
