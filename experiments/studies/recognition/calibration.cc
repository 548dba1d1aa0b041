#include "experiments/studies/recognition/calibration.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/farm/farm.h"
#include "experiments/report/json.h"
#include "experiments/search/optimiser.h"
#include "experiments/studies/recognition/look.h"
#include "experiments/studies/recognition/near_truth.h"
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
std::vector<TableRow> ChosenRows(const std::vector<TableRow>& tables, double share) {
  std::map<std::pair<MarkerKind, double>, std::vector<TableRow>> columns;
  for (const TableRow& row : tables) columns[{row.cell.marker, row.cell.distance_m}].push_back(row);
  std::vector<TableRow> rows;
  for (auto& [place, column] : columns) {
    std::ranges::sort(column, {}, [](const TableRow& row) { return row.cell.milk_ml_m3; });
    const auto cells = static_cast<double>(column.size());
    const int chosen = std::max(1, static_cast<int>(std::lround(share * cells)));
    for (int i = 0; i < chosen; ++i)
      rows.push_back(column[static_cast<size_t>((i + 0.5) * cells / chosen)]);
  }
  return rows;
}

std::optional<double> NumberOf(const report::Json& json) {
  return json.is_null() ? std::optional<double>() : json.get<double>();
}

TableRow RowOf(const report::Json& json) {
  return {.cell = {MarkersOf(json["marker"]).front(), json["milk_ml_m3"], json["distance_m"]},
          .fitness_mean = json["fitness_mean"],
          .fitness_std = NumberOf(json["fitness_std"])};
}

struct Stopped {};

// What a run that has nothing to measure counts as.
constexpr double kMisfitOfNothing = 3;

// Of a value that is to reach at least a bound: 1 there, 2 at zero.
double ShortOf(double bound, double value) { return std::max(0.0, 2 - value / bound); }

// The pictures that are described in print: the balls in clear water; the passive marker's last.
std::vector<RecognitionCell> PicturesOf(const std::vector<TableRow>& tables) {
  constexpr double kClearView_m = 0.6;
  std::set<RecognitionCell> clear;
  std::map<double, RecognitionCell> last;  // by distance
  for (const auto& [cell, fitness_mean, fitness_std] : tables) {
    clear.insert({cell.marker, 0, kClearView_m});
    if (cell.marker != MarkerKind::kPassive) continue;
    RecognitionCell& one = last.try_emplace(cell.distance_m, cell).first->second;
    one = std::max(one, cell);
  }
  std::vector<RecognitionCell> cells(clear.begin(), clear.end());
  for (const auto& [distance_m, cell] : last) cells.push_back(cell);
  return cells;
}

std::vector<RecognitionCell> Joined(const std::vector<TableRow>& rows,
                                    const std::vector<RecognitionCell>& more) {
  std::vector<RecognitionCell> cells = CellsOf(rows);
  cells.insert(cells.end(), more.begin(), more.end());
  return cells;
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
  return logarithmic ? low * std::pow(high / low, place) : low + (high - low) * place;
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
                                             const std::vector<TableRow>& tables)
    : plan_(plan),
      text_(report::JsonLine({{"plan", plan}, {"tables", tables}})),
      rows_(ChosenRows(tables, plan.cell_share)),
      pictures_(PicturesOf(tables)),
      recognition_(ScenariosOf(rows_, plan.Assignments(plan.Start())), Joined(rows_, pictures_)) {
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

Evaluation CalibrationExperiment::Evaluate(const std::vector<double>& values) {
  recognition_.set_scenarios(ScenariosOf(rows_, plan_.Assignments(values)));
  std::vector<CellResult> results;
  Evaluation evaluation{.values = values, .constraints = {}, .fitness = {}};
  for (const TableRow& row : rows_) {
    results.push_back(RunNearTruth(recognition_, row.cell, plan_.frames));
    evaluation.fitness.push_back(results.back().fitness_mean);
  }
  evaluation.constraints = ConstraintsOf(results);
  return evaluation;
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
    for (Constraint& c : TableConstraints(marker, Compare(one.first, one.second), plan_.accepted))
      constraints.push_back(std::move(c));
  return constraints;
}

std::vector<Constraint> CalibrationExperiment::PictureConstraints() const {
  std::vector<Constraint> constraints;
  for (const RecognitionCell& cell : pictures_) {
    const trial::Scenario& scenario = recognition_.scenario(cell.marker);
    const Look look = LookOf(recognition_.Image(cell, 0).left, scenario.rig.MakeRig().left,
                             scenario.marker, Pose::Translation(cell.distance_m, 0, 0));
    const auto add = [&](const char* what, double value, double misfit) {
      constraints.push_back({fmt::format("{} {} at {:g} mm", NameOf(cell.marker), what,
                                         units::MmFromM(cell.distance_m)),
                             value, misfit});
    };
    if (cell.milk_ml_m3 == 0) {
      add("ball", look.ball_dn, ShortOf(plan_.accepted.ball_dn, look.ball_dn));
    } else {
      add("white", look.brightness_dn, ShortOf(plan_.accepted.white_dn, look.brightness_dn));
      add("saturation", look.saturation, look.saturation / plan_.accepted.white_saturation);
    }
  }
  return constraints;
}

farm::Work CalibrationWork(std::shared_ptr<CalibrationExperiment> drawn) {
  return {"set of values", [drawn = std::move(drawn)](const std::string& input) mutable {
            const size_t line = input.find('\n');
            const std::string text = input.substr(0, line);
            if (!drawn || drawn->text() != text) {
              const report::Json json = report::ParseJson(text, "a calibration");
              std::vector<TableRow> tables;
              for (const report::Json& row : json["tables"]) tables.push_back(RowOf(row));
              drawn = std::make_shared<CalibrationExperiment>(json["plan"].get<CalibrationPlan>(),
                                                              tables);
            }
            const report::Json values = report::ParseJson(input.substr(line), "a set of values");
            return report::JsonLine(drawn->Evaluate(values.get<std::vector<double>>()));
          }};
}

std::string InputOf(const CalibrationExperiment& experiment, const std::vector<double>& values) {
  return experiment.text() + "\n" + report::JsonLine(values);
}

Evaluation EvaluationOf(const std::string& output) {
  const report::Json json = report::ParseJson(output, "an evaluation");
  Evaluation evaluation{.values = json["values"].get<std::vector<double>>(),
                        .constraints = {},
                        .fitness = json["fitness"].get<std::vector<double>>()};
  for (const report::Json& c : json["constraints"])
    evaluation.constraints.push_back({c["constraint"], NumberOf(c["value"]), c["misfit"]});
  return evaluation;
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

CalibrationResult Calibrate(const CalibrationOptions& options,
                            const std::shared_ptr<CalibrationExperiment>& experiment) {
  const CalibrationPlan& plan = experiment->plan();
  const size_t n = plan.parameters.size();
  search::Candidate best_places;
  for (const FreeParameter& p : plan.parameters) best_places.push_back(p.PlaceOf(p.start));
  const search::Candidate start = best_places;
  CalibrationResult result{.best = {.values = plan.Start(), .constraints = {}, .fitness = {}},
                           .misfit = std::numeric_limits<double>::infinity()};
  const search::OptimiserParams optimiser{
      .population = std::max(5, 4 + static_cast<int>(3 * std::log(static_cast<double>(n)))),
      .generations = options.generations,
      .initial_step = plan.spread};
  const int planned = 1 + optimiser.population * optimiser.generations + 2 * static_cast<int>(n);
  const auto pool =
      farm::MakePool(options.farm, farm::kJobTimeLimit_s, CalibrationWork(experiment));
  int done = 0;
  // Nothing of those that a stop has prevented.
  const auto evaluations_at = [&](const std::vector<search::Candidate>& candidates) {
    std::vector<std::string> inputs;
    for (const search::Candidate& places : candidates) {
      std::vector<double> values;
      for (size_t i = 0; i < n; ++i) values.push_back(plan.parameters[i].ValueAt(places[i]));
      inputs.push_back(InputOf(*experiment, values));
    }
    std::vector<std::optional<Evaluation>> evaluations(candidates.size());
    double best = result.misfit;
    const auto take = [&](size_t i, const std::string& output) {
      evaluations[i] = EvaluationOf(output);
      best = std::min(best, Misfit(evaluations[i]->constraints));
      if (options.on_progress) options.on_progress(++done, planned, best);
    };
    farm::MapEach(pool.get(), inputs, take, options.stop_requested);
    return evaluations;
  };
  // In the candidates' order, whichever ended first.
  const auto evaluate = [&](int, const std::vector<search::Candidate>& candidates) {
    const std::vector<std::optional<Evaluation>> evaluations = evaluations_at(candidates);
    std::vector<double> worths;
    for (size_t i = 0; i < evaluations.size(); ++i) {
      if (!evaluations[i]) continue;
      const double misfit = Misfit(evaluations[i]->constraints);
      ++result.evaluations;
      worths.push_back(misfit);
      if (misfit >= result.misfit) continue;
      result.misfit = misfit;
      result.best = *evaluations[i];
      best_places = candidates[i];
    }
    if (worths.size() < candidates.size()) throw Stopped();
    return worths;
  };

  try {
    search::Optimise(optimiser, options.seed, start, evaluate);
    std::vector<search::Candidate> sides;
    for (size_t i = 0; i < n; ++i)
      for (const double step : {-0.05, 0.05}) {
        sides.push_back(best_places);
        sides.back()[i] = std::clamp(best_places[i] + step, 0.0, 1.0);
      }
    const std::vector<std::optional<Evaluation>> beside = evaluations_at(sides);
    if (!std::ranges::all_of(beside, [](const auto& side) { return side.has_value(); }))
      throw Stopped();
    for (size_t i = 0; i < n; ++i)
      result.misfit_beside.emplace_back(Misfit(beside[2 * i]->constraints),
                                        Misfit(beside[2 * i + 1]->constraints));
  } catch (const Stopped&) {
  }
  return result;
}

}  // namespace turbidock::recognition
