#pragma once
// Calibration: the few uncertain optical and camera parameters, one value for both markers, all
// distances and all milk, that bring the recognition experiment closest to what is known of the
// published one.
//
// What is known are constraints, each with a misfit in units of what is accepted of it. CMA-ES
// searches the least root of the mean square of all misfits, a generation at a time, whose sets of
// values are evaluated side by side. For the search F is looked for near the true pose only, in
// some of the tables' cells (RunNearTruth); `turbidock recognize --table` confirms the result by
// searches that begin knowing nothing.

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/job_pool.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"

namespace turbidock::recognition {

// One parameter to be found.
struct FreeParameter {
  std::string key;  // of the scenario, dotted; "group.list[0]" for an element
  double low = 0, high = 1, start = 0.5;
  bool logarithmic = false;        // searched by its logarithm
  std::string source;              // where the range comes from
  std::vector<double> ratio = {};  // where the key is a list: it is these, times the value

  static void Fields(auto& self, auto&& field) {
    field("key", self.key, Finite(), "key of the scenario");
    field("low", self.low, Finite(), "least value that its source allows");
    field("high", self.high, Finite(), "largest value that its source allows");
    field("start", self.start, Finite(), "where the search begins");
    field("logarithmic", self.logarithmic, Finite(), "searched by its logarithm");
    field("source", self.source, Finite(), "where the range comes from");
    field("ratio", self.ratio, Finite(), "where the key is a list: it is these, times the value");
  }
  void Check(const std::string& path) const;

  double ValueAt(double place) const;  // of a place in [0, 1] between low and high
  double PlaceOf(double value) const;
};

// What is searched, as a data file describes it.
struct CalibrationPlan {
  std::vector<FreeParameter> parameters;
  double cell_share = 0.5;  // of the tables' cells that the search uses
  int frames = 2;           // of a cell
  double spread = 0.1;      // of the first generation, as a share of each range

  static void Fields(auto& self, auto&& field) {
    field("parameters", self.parameters, Finite(), "what is searched");
    field("cell_share", self.cell_share, InRange(0.01, 1),
          "share of the tables' cells that the search looks at, evenly over milk");
    field("frames", self.frames, InRange(1, 10000), "images of a cell that the search looks at");
    field("spread", self.spread, InRange(0.001, 1),
          "standard deviation of the first generation, as a share of each range");
  }
  void Check(const std::string& path) const;

  std::vector<double> Start() const;  // by parameter
  std::vector<double> ValuesAt(const std::vector<double>& places) const;
  // "key=value" of each, for --set.
  std::vector<std::string> Assignments(const std::vector<double>& values) const;
};

CalibrationPlan LoadCalibrationPlan(const std::string& path);

// One thing that is known of the experiment and what a run makes of it. Misfit 1: as far off as is
// accepted; 0: met in full.
struct Constraint {
  std::string constraint;
  std::optional<double> value;  // nothing: the run has none, as of a marker that is never lost
  double misfit = 0;

  TURBIDOCK_FIELDS(constraint, value, misfit)
};

// Those of a run against its table. A distance at which the table's marker is not lost has none.
std::vector<Constraint> TableConstraints(MarkerKind marker, const TableComparison& comparison);

// Root of the mean square.
double Misfit(const std::vector<Constraint>& constraints);

// One set of values and its objective value.
struct Evaluation {
  std::vector<double> values = {};           // in the order of the plan's parameters
  std::vector<Constraint> constraints = {};  // of the cells that the search looks at
  std::vector<double> fitness = {};          // mean F of each of those cells
  double misfit = std::numeric_limits<double>::infinity();

  TURBIDOCK_FIELDS(values, constraints, fitness, misfit)
};

// The experiment as the search runs it.
struct CalibrationExperiment {
  CalibrationPlan plan;
  std::vector<TableRow> rows;  // that it looks at: evenly over each column's milk

  TURBIDOCK_FIELDS(plan, rows)
};

// ConfigError for a key, or an element of a list, that cannot be set or written, for start
// values that are impossible together, and for a key that changes F in none of these rows. That
// takes two images a key, and where there is such a key two a row.
CalibrationExperiment ExperimentOf(const CalibrationPlan& plan,
                                   const std::vector<TableRow>& tables);

// F near the true pose: what the search ends with, without the search, for a calibration, which
// asks a thousand times. F of a frame is the best of some hundred poses, most of them about the
// true one; the rest, farther away, find what noise happens to agree with when the marker is lost.
// That is within 0.06 of F by the search. Deterministic. `view` and `water` are the cell's.
CellResult RunNearTruth(const trial::FixedView& view, const light::Water& water,
                        const trial::Scenario& scenario, const RecognitionCell& cell, int frames);

// How F agrees with a column of a table. `left_out`: the search did not see that distance.
struct ColumnError {
  MarkerKind marker = MarkerKind::kActive;
  double distance_m = 0;
  bool left_out = false;
  double rmse = 0, area_agreement = 0;

  TURBIDOCK_FIELDS(marker, distance_m, left_out, rmse, area_agreement)
};

// Deterministic. What the cameras have before them is drawn anew: values may move lamps. Values
// that are impossible together, such as a lamp in the hull, have no constraints and a misfit of 3.
Evaluation Evaluate(const CalibrationExperiment& experiment, const std::vector<double>& values);

// Of each marker at each distance, near the true pose: all cells of the tables with these values.
// ConfigError for values that are impossible together.
std::vector<ColumnError> ErrorsByColumn(const CalibrationPlan& plan,
                                        const std::vector<double>& values,
                                        const std::vector<TableRow>& tables,
                                        const std::vector<double>& left_out_m);

// The rows of all distances but these. ConfigError for one that no table has, and where nothing
// is left.
std::vector<TableRow> Without(const std::vector<double>& left_out_m,
                              const std::vector<TableRow>& tables);

// Evaluates {"experiment", "values"}: the work of a task.
batch::Work EvaluationWork();

struct CalibrationResult {
  Evaluation best = {};
  int evaluations = 0;
  bool is_complete = false;               // it was not stopped
  std::vector<ColumnError> columns = {};  // of the best, if they were asked for (ErrorsByColumn)
};

struct CalibrationOptions {
  int generations = 30;  // 0: only the start is evaluated
  uint32_t seed = 1;
  // Keeps every evaluation, or goes on with those that are there. Empty: none.
  std::string file = {};
  batch::JobOptions jobs = {};
  // After each evaluation; `of` is how many there will be at most.
  std::function<void(int done, int of, double best_misfit)> on_progress = {};
  std::function<bool()> stop_requested = {};
};

// The published optics (assets/optics.yaml) with these values instead of theirs, as YAML to take
// their place. A key may be an element of a list that is there: "lights.lamps.intensity_w_sr[0]".
std::string CalibratedYaml(const CalibrationPlan& plan, const std::vector<double>& values);

// Searches from the plan's start values; the result is the same whoever evaluates, and after any
// interruption. Stopped, which does not wait for evaluations under way, it returns the best so far.
// ConfigError when the file is of another plan, table, seed, scenario, model or build.
CalibrationResult Calibrate(const CalibrationOptions& options,
                            const CalibrationExperiment& experiment);

// Kind "calibration", and the study's own keys: README.md.
report::Report ReportOf(const CalibrationPlan& plan, const CalibrationResult& result);
report::Json ResultJson(const CalibrationPlan& plan, const CalibrationResult& result);

}  // namespace turbidock::recognition
