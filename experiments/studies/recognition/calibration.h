#pragma once
// Calibration: the few uncertain optical and camera parameters, one value for both markers, all
// distances and all milk, that bring the recognition experiment closest to what is known of the
// published one.
//
// That is the tables and how the pictures are described: constraints, each with a misfit in units
// of what is accepted of it. CMA-ES searches the least root of the mean square of all misfits, a
// generation at a time, whose sets of values are evaluated side by side. For the search F is looked
// for near the true pose only, in some of the tables' cells (near_truth.h); the result is confirmed
// on all cells by searches that begin knowing nothing.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/farm/farm.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"

namespace turbidock::recognition {

// One parameter to be found.
struct FreeParameter {
  std::string key;  // of the scenario, dotted; "group.list[0]" for an element
  double low = 0, high = 1, start = 0.5;
  bool logarithmic = false;  // searched by its logarithm
  std::string source;        // where the range comes from

  static void Fields(auto& self, auto&& field) {
    field("key", self.key, Finite(), "key of the scenario");
    field("low", self.low, Finite(), "least value that its source allows");
    field("high", self.high, Finite(), "largest value that its source allows");
    field("start", self.start, Finite(), "where the search begins");
    field("logarithmic", self.logarithmic, Finite(), "searched by its logarithm");
    field("source", self.source, Finite(), "where the range comes from");
  }
  void Check(const std::string& path) const;

  double ValueAt(double place) const;  // of a place in [0, 1] between low and high
  double PlaceOf(double value) const;
  std::string Assignment(double value) const;  // "key=value" for --set
};

// How far a run may be from what is known, for each thing that is.
struct AcceptedErrors {
  double rmse_active = 0.05, rmse_passive = 0.075;
  double other_area = 0.08;
  double loss = 0.1;
  double lost_fitness = 0.03;
  double rise = 0.03;
  double least_std = 0.02, largest_std = 0.06;
  double ball_dn = 60;
  double white_dn = 120, white_saturation = 0.2;

  static void Fields(auto& self, auto&& field) {
    field("rmse_active", self.rmse_active, Above(0), "error of mean F, active marker");
    field("rmse_passive", self.rmse_passive, Above(0), "error of mean F, passive marker");
    field("other_area", self.other_area, Above(0), "share of cells in another Area");
    field("loss", self.loss, Above(0), "milk at which F falls to 0.22, over the table's, less one");
    field("lost_fitness", self.lost_fitness, Above(0), "error of mean F of a lost marker");
    field("rise", self.rise, Above(0),
          "how much better than in clear water F must get by a little milk, nearest distance");
    field("least_std", self.least_std, Above(0), "least mean deviation of F in a cell");
    field("largest_std", self.largest_std, Above(0), "largest mean deviation of F in a cell");
    field("ball_dn", self.ball_dn, Above(0),
          "8-bit steps that a ball must stand out at 0.6 m in clear water");
    field("white_dn", self.white_dn, Above(0),
          "brightness that the passive marker's image must have at the table's last milk");
    field("white_saturation", self.white_saturation, Above(0), "saturation that it may have");
  }
};

// What is searched, as a data file describes it.
struct CalibrationPlan {
  std::vector<FreeParameter> parameters;
  AcceptedErrors accepted;
  double cell_share = 0.5;  // of the tables' cells that the search uses
  int frames = 2;           // of a cell
  double spread = 0.1;      // of the first generation, as a share of each range

  static void Fields(auto& self, auto&& field) {
    field("parameters", self.parameters, Finite(), "what is searched");
    field("accepted", self.accepted, Finite(), "how far off the result may be");
    field("cell_share", self.cell_share, InRange(0.01, 1),
          "share of the tables' cells that the search looks at, evenly over milk");
    field("frames", self.frames, InRange(1, 10000), "images of a cell that the search looks at");
    field("spread", self.spread, InRange(0.001, 1),
          "standard deviation of the first generation, as a share of each range");
  }
  void Check(const std::string& path) const;

  std::vector<double> Start() const;  // by parameter
  // "key=value" of each, for --set.
  std::vector<std::string> Assignments(const std::vector<double>& values) const;
};

CalibrationPlan LoadCalibrationPlan(const std::string& path);

// One thing that is known of the experiment and what a run makes of it. Misfit 1: as far off as is
// accepted; 0: met in full.
struct Constraint {
  std::string name;
  std::optional<double> value;  // nothing: the run has none, as of a marker that is never lost
  double misfit = 0;

  static void Fields(auto& self, auto&& field) {
    field("constraint", self.name);
    field("value", self.value);
    field("misfit", self.misfit);
  }
};

// Those of a run against its table. A distance at which the table's marker is not lost has none.
std::vector<Constraint> TableConstraints(MarkerKind marker, const TableComparison& comparison,
                                         const AcceptedErrors& accepted);

// Root of the mean square.
double Misfit(const std::vector<Constraint>& constraints);

// One set of values and what it is worth.
struct Evaluation {
  std::vector<double> values;           // in the order of the plan's parameters
  std::vector<Constraint> constraints;  // of the cells that the search looks at
  std::vector<double> fitness;          // mean F of each of those cells

  TURBIDOCK_FIELDS(values, constraints, fitness)
};

// The experiment as the search runs it. Drawing is done when it is made.
class CalibrationExperiment {
 public:
  // ConfigError for a key, or an element of a list, that cannot be set or written.
  CalibrationExperiment(const CalibrationPlan& plan, const std::vector<TableRow>& tables);
  CalibrationExperiment(const CalibrationExperiment&) = delete;
  CalibrationExperiment& operator=(const CalibrationExperiment&) = delete;

  const CalibrationPlan& plan() const { return plan_; }
  // The chosen cells, evenly over each column's milk.
  const std::vector<TableRow>& rows() const { return rows_; }
  // In a line: plan and tables.
  const std::string& text() const { return text_; }

  // Deterministic.
  Evaluation Evaluate(const std::vector<double>& values);
  // What these results of the rows, and pictures under the values evaluated last, make of all that
  // is known.
  std::vector<Constraint> ConstraintsOf(const std::vector<CellResult>& results) const;

 private:
  std::vector<Constraint> PictureConstraints() const;

  CalibrationPlan plan_;
  std::string text_;
  std::vector<TableRow> rows_;
  std::vector<RecognitionCell> pictures_;
  Recognition recognition_;  // of rows and pictures
};

// Evaluates sets of values: the work of a task. A worker that has drawn an experiment (or was given
// one that is drawn) keeps it for its next job.
farm::Work CalibrationWork(std::shared_ptr<CalibrationExperiment> drawn = nullptr);

// A set of values as its input, and what came out.
std::string InputOf(const CalibrationExperiment& experiment, const std::vector<double>& values);
Evaluation EvaluationOf(const std::string& output);

struct CalibrationResult {
  Evaluation best;
  double misfit = 0;  // of the best
  int evaluations = 0;
  // By parameter: misfit with it a twentieth of its range lower and higher.
  std::vector<std::pair<double, double>> misfit_beside = {};
};

struct CalibrationOptions {
  int generations = 30;  // 0: no search, only what the start and its sides are worth
  uint32_t seed = 1;
  farm::FarmOptions farm = {};
  // After each evaluation; `of` is how many there will be at most.
  std::function<void(int done, int of, double best_misfit)> on_progress = {};
  std::function<bool()> stop_requested = {};
};

// The published optics (assets/optics.yaml) with these values instead of theirs, as YAML to take
// their place. A key may be an element of a list that is there: "lamps.intensity_w_sr[0]".
std::string CalibratedYaml(const CalibrationPlan& plan, const std::vector<double>& values);

// Searches from the plan's start values; the result is the same whoever evaluates. Stopped, which
// does not wait for evaluations under way, it returns the best so far without what is beside.
CalibrationResult Calibrate(const CalibrationOptions& options,
                            const std::shared_ptr<CalibrationExperiment>& experiment);

// How the whole experiment under the values found compares with its tables; a marker that was not
// confirmed has none.
using Confirmation = std::map<MarkerKind, TableComparison>;

// Kind "calibration", and the study's own keys: README.md.
report::Report ReportOf(const CalibrationExperiment& experiment, const CalibrationResult& result,
                        const Confirmation& confirmed);
report::Json ResultJson(const CalibrationExperiment& experiment, const CalibrationResult& result,
                        const Confirmation& confirmed);

}  // namespace turbidock::recognition
