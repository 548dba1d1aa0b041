#pragma once
// How often an estimator is right, how often it is wrong and sure of it, and how often it finds
// nothing: cold starts at random poses about some distances and in some turbidities, every
// estimator on images of the same seeds, which are the same.
//
// A start is the world of a trial (trial/world.h) in which nothing moves, with all of the marker's
// balls in sight. An estimator gets its first frames, with whatever the scenario's faults do to
// them, and is judged by its estimate of the last one.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/job_pool.h"
#include "experiments/report/report.h"
#include "experiments/statistics/intervals.h"
#include "experiments/trial/plugins.h"
#include "sim/base/result_fields.h"
#include "sim/base/units.h"

namespace turbidock::estimators {

struct CompareOptions {
  std::vector<std::string> scenarios = {"pool_active", "pool_passive"};
  std::vector<std::string> assignments = {};  // to all of them
  // Values of the key pose_estimator, plug-ins among them; none: what each scenario has.
  std::vector<std::string> estimators = {};
  std::vector<double> distances_mm = {400, 600, 800, 1000};
  std::vector<double> milk_ml_m3 = {0, 10, 20, 40, 80};
  int starts = 20;  // a cell; their seeds are the scenario's own and those that follow
  int frames = 30;  // a start
  double right_mm = 20, right_deg = 5;  // a right estimate is within both
  trial::Plugins plugins = {};
  batch::JobOptions jobs = {};
  std::function<void(int done, int of)> on_progress = {};  // starts
  std::function<bool()> stop_requested = {};
};

// What an estimator says of a start.
struct StartResult {
  int64_t seed = 0;
  // F of the last estimate is at least the scenario's procedure.lost_fitness: docking would use it.
  bool is_sure = false;
  double error_m = 0, rotation_rad = 0;  // of that estimate
  double fitness = 0;
  double frame_s = 0;  // median processor time of a frame

  TURBIDOCK_FIELDS(seed, is_sure, error_m, rotation_rad, fitness, frame_s)
};

// One estimator at one distance in one turbidity.
struct CompareCell {
  std::string scenario;
  double distance_mm = 0, milk_ml_m3 = 0;
  std::string estimator;
  int starts = 0, right = 0, wrong_and_sure = 0, not_found = 0;
  statistics::Interval right_interval = {}, wrong_and_sure_interval = {};  // Wilson, 95 %
  // Medians of the estimates that are sure; of the time, over all starts.
  std::optional<double> error_median_m = {}, rotation_median_rad = {}, frame_s = {};
  std::vector<StartResult> each = {};

  TURBIDOCK_FIELDS(scenario, distance_mm, milk_ml_m3, estimator, starts, right, right_interval,
                   wrong_and_sure, wrong_and_sure_interval, not_found, error_median_m,
                   rotation_median_rad, frame_s, each)
};

// Makes one start of one estimator: the work of a task. `plugins`: as CompareOptions'.
batch::Work StartWork(const trial::Plugins& plugins);

// Nothing when it was stopped. The same for any number of workers, but for times. ConfigError for
// what is wrong in a scenario or is no estimator of it.
std::vector<CompareCell> CompareEstimators(const CompareOptions& options);

// Counts and medians of `each`.
void Summarise(const CompareOptions& options, CompareCell* cell);

// Kind "estimators".
report::Report ReportOf(const std::vector<CompareCell>& cells);

}  // namespace turbidock::estimators
