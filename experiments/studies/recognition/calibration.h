#pragma once
// Calibration: the few uncertain optical and camera parameters, one value for both markers, all
// distances and all milk, that bring the recognition experiment closest to published tables.
//
// What is searched, by CMA-ES (pagmo), is the least misfit over a choice of the tables' cells: RMSE
// of F, Areas and milk of loss together, see Misfit. For the search the estimator is told where the
// marker is and a cell is watched for a fraction of a second; the result is confirmed on all cells
// by searches that begin knowing nothing.

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "experiments/farm/fork_map.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"

namespace turbidock::recognition {

// One parameter to be found.
struct FreeParameter {
  std::string key;  // of the scenario, dotted; "group.list[0]" for an element
  double low = 0, high = 1, start = 0.5;
  bool logarithmic = false;  // searched by its logarithm
  bool integer = false;
  std::string source;  // where the range comes from

  static void Fields(auto& self, auto&& field) {
    field("key", self.key, Finite(), "key of the scenario");
    field("low", self.low, Finite(), "least value that its source allows");
    field("high", self.high, Finite(), "largest value that its source allows");
    field("start", self.start, Finite(), "where the search begins");
    field("logarithmic", self.logarithmic, Finite(), "searched by its logarithm");
    field("integer", self.integer, Finite(), "whole numbers only");
    field("source", self.source, Finite(), "where the range comes from");
  }
  void Check(const std::string& path) const;

  double ValueAt(double place) const;  // of a place in [0, 1] between low and high
  double PlaceOf(double value) const;
  std::string Assignment(double value) const;  // "key=value" for --set
};

// What is searched, as a data file describes it.
struct CalibrationPlan {
  std::vector<FreeParameter> parameters;
  double cell_share = 0.5;  // of the tables' cells that the search uses
  double seconds = 0.4;     // a cell, after settling
  double spread = 0.1;      // of the first generation, as a share of each range

  static void Fields(auto& self, auto&& field) {
    field("parameters", self.parameters, Finite(), "what is searched");
    field("cell_share", self.cell_share, InRange(0.01, 1),
          "share of the tables' cells that the search looks at, evenly over milk");
    field("seconds", self.seconds, InRange(0.02, 3600), "time the search watches a cell");
    field("spread", self.spread, InRange(0.001, 1),
          "standard deviation of the first generation, as a share of each range");
  }
  void Check(const std::string& path) const;

  std::vector<double> Start() const;  // by parameter
  // "key=value" of each, for --set.
  std::vector<std::string> Assignments(const std::vector<double>& values) const;
};

CalibrationPlan LoadCalibrationPlan(const std::string& path);

using TableByMarker = std::map<MarkerKind, std::vector<TableRow>>;

// How far a run is from its table, in units of what is accepted: the root of the mean square of
// RMSE over 0.07, cells in another Area over 10 %, and the milk of loss, ratio - 1 over 12 % (root
// mean square over the distances; a marker that is never lost, or never seen, counts as 36 % off; a
// distance at which the table's is not lost does not count). 1: on the whole, as far off as may be.
double Misfit(const TableComparison& comparison);

// The experiment as the search runs it.
class CalibrationExperiment {
 public:
  // ConfigError for a key, or an element of a list, that cannot be set or written.
  CalibrationExperiment(const CalibrationPlan& plan, const TableByMarker& tables);

  // The chosen cells, evenly over each column's milk.
  const std::vector<TableRow>& rows() const { return rows_; }
  // Every row's result under these assignments; nothing when it was stopped. Deterministic.
  std::vector<CellResult> Run(const std::vector<std::string>& assignments,
                              const farm::ForkMapOptions& run);
  // How far such results are from the tables: root mean square of the tables' misfits.
  double MisfitOf(const std::vector<CellResult>& results) const;

 private:
  double seconds_;
  std::vector<TableRow> rows_;
  Recognition recognition_;
};

struct CalibrationResult {
  std::vector<double> values = {};  // in the order of the plan's parameters
  double misfit = 0;                // of the cells that the search looks at
  int evaluations = 0;
  // By parameter: misfit with it a twentieth of its range lower and higher.
  std::vector<std::pair<double, double>> misfit_beside = {};
};

struct CalibrationOptions {
  int generations = 30;  // 0: no search, only what the start and its sides are worth
  uint32_t seed = 1;
  int workers = 1;
  // After each evaluation; `of` is how many there will be at most.
  std::function<void(int done, int of, double best_misfit)> on_progress = {};
  std::function<bool()> stop_requested = {};
};

// The calibrated optics (assets/optics.yaml) with these values instead of theirs, as YAML to take
// their place. A key may be an element of a list that is there: "lamps.intensity_w_sr[0]".
std::string CalibratedYaml(const CalibrationPlan& plan, const std::vector<double>& values);

// Searches from the plan's start values. Stopped, it returns the best so far without what is
// beside.
CalibrationResult Calibrate(const CalibrationPlan& plan, const CalibrationOptions& options,
                            CalibrationExperiment* experiment);

}  // namespace turbidock::recognition
