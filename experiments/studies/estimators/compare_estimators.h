#pragma once
// Estimators side by side on the same simulated frames and the same budget of evaluations, from a
// cold start, over distance and milk: how often each finds the marker, how exactly, in what time,
// and how well its fitness tells its error. Beside markers at rest: anywhere in the search range,
// moving, absent (CompareTask).

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/farm/fork_map.h"
#include "experiments/statistics/intervals.h"
#include "experiments/studies/estimators/compare_task.h"
#include "experiments/studies/recognition/recognition.h"
#include "sim/base/result_fields.h"
#include "sim/base/units.h"
#include "vision/pose_estimator.h"

namespace turbidock::estimators {

// Names, in the order they are reported:
//   default    RM-GA in the default preset
//   search     the same without refinement
//   published  RM-GA as published
//   de, pso, cmaes   pagmo's optimisers on the same fitness
//   blobs      colour segmentation, triangulation, absolute orientation
// One more, `fiducial`, reads the tags of the fiducial marker; other markers it does not judge.
// The first three may carry changed keys of RmGaOptions: default/creep_share=0/track=false. A
// scenario's plug-ins come beside these, with keys of their own in the same way.
std::vector<std::string> EstimatorNames();

// ConfigError for what is unknown or wrong in a name. `scenario` gives marker, hue, rig and the
// search's options.
std::unique_ptr<vision::PoseEstimator> MakeEstimator(const std::string& name,
                                                     const trial::Scenario& scenario,
                                                     uint64_t seed);

struct CompareOptions {
  CompareTask task = CompareTask::kStill;
  std::vector<recognition::MarkerKind> markers = recognition::MarkersOf("both");
  std::vector<double> distances_m = {0.4, 0.6, 0.8, 1.0};  // of tasks about a distance
  std::vector<double> milk_ml_m3 = {0, 10, 20, 40, 80};
  std::vector<std::string> estimators = EstimatorNames();
  int starts = 20;  // in each cell, each with pose, noise and random numbers of its own
  int frames = 30;  // each estimator sees of each start
  // An estimate within both counts as found.
  double found_m = 0.02, found_rad = 0.0873;
  std::vector<std::string> assignments;         // to the scenarios
  trial::Plugins plugins;                       // whose estimators can be named, too
  farm::ForkMapOptions run;                     // a job is some starts of a marker at a distance
  std::optional<farm::SlurmParams> slurm = {};  // jobs are run by its tasks; none: here
};

// Runs a job: the work of a task. `plugins`: as CompareOptions'.
farm::Work CompareWork(const trial::Plugins& plugins);

// A start that an estimator did not find.
struct CompareMiss {
  Pose true_X_HM;  // at the end
  double error_m = 0, rotation_rad = 0, fitness = 0;

  static void Fields(auto& self, auto&& field) {
    field("position_m", self.true_X_HM.p);
    field("quaternion_wxyz", self.true_X_HM.q);
    self.VisitFields(field);
  }
  TURBIDOCK_VISIT_FIELDS(error_m, rotation_rad, fitness)
};

// One estimator in one cell. The error of a start, found or not, is the last frame's; that of a
// moving marker the largest after kMovingSettleFrames.
struct CompareRow {
  recognition::RecognitionCell cell;  // distance 0: the task is not about one
  std::string estimator;
  int starts = 0, found = 0;
  statistics::Interval found_interval;  // Wilson, 95 %
  double error_median_m = 0;
  statistics::Interval error_median_interval_m;  // from order statistics, 95 %
  double error_95_m = 0, error_worst_m = 0;
  double rotation_median_rad = 0;
  statistics::Interval rotation_median_interval_rad;
  double rotation_95_rad = 0;
  // Of a marker at rest: the first frame, from 1, from which on the estimates are within what
  // counts as found. By half of the starts, by 95 % of them; nothing where fewer are found.
  std::optional<int> frames_median, frames_95;
  double detected = 0;  // share of frames: of the last ones; moving: once settled; absent: of all
  double fitness_mean = 0;
  double frame_s = 0;  // median processor time of a frame, labels included
  double evaluations_per_frame = 0;
  std::vector<double> errors_m, rotations_rad, fitness;  // by start
  std::vector<bool> is_found;
  std::vector<CompareMiss> misses;

  static void Fields(auto& self, auto&& field) {
    field("marker", self.cell.marker);
    field("distance_mm", units::MmFromM(self.cell.distance_m));
    field("milk_ml_m3", self.cell.milk_ml_m3);
    self.VisitFields(field);
  }
  TURBIDOCK_VISIT_FIELDS(estimator, starts, found, found_interval, error_median_m,
                         error_median_interval_m, error_95_m, error_worst_m, rotation_median_rad,
                         rotation_median_interval_rad, rotation_95_rad, detected, fitness_mean,
                         frame_s, evaluations_per_frame, frames_median, frames_95, misses)
};

// The frame by which that share of the starts is found, given when each of those found was; nothing
// where fewer are.
std::optional<int> FrameBy(double share, std::vector<int> found_frames, int starts);

// Nothing when it was stopped. The same whatever the number of workers, but for the times.
std::vector<CompareRow> CompareEstimators(const CompareOptions& options);

// How well fitness orders the estimates by their error: Spearman's rank correlation, negative where
// a higher fitness means a smaller error; over all rows of that marker and estimator.
double FitnessErrorCorrelation(const std::vector<CompareRow>& rows, recognition::MarkerKind marker,
                               const std::string& estimator);

// The estimates whose fitness lies in [low, high), over all rows of a marker and estimator.
struct FitnessBin {
  double low = 0, high = 0;
  int starts = 0, found = 0;
  statistics::Interval found_interval = {};  // Wilson, 95 %
  double error_median_m = 0, error_95_m = 0;
  double rotation_median_rad = 0, rotation_95_rad = 0;

  static void Fields(auto& self, auto&& field) {
    field("fitness", std::array{self.low, self.high});
    self.VisitFields(field);
  }
  TURBIDOCK_VISIT_FIELDS(starts, found, found_interval, error_median_m, error_95_m,
                         rotation_median_rad, rotation_95_rad)
};

// Areas III and II, and Area I in steps of 0.1; those that hold an estimate.
std::vector<FitnessBin> FitnessBins(const std::vector<CompareRow>& rows,
                                    recognition::MarkerKind marker, const std::string& estimator);

std::string CompareText(const std::vector<CompareRow>& rows);
// The cells' keys of the JSON in mm, degrees and ms; an interval is two columns.
std::string CompareCsv(const std::vector<CompareRow>& rows);
std::string CompareJson(const std::vector<CompareRow>& rows);
// Share found, median error and median rotation error over milk: a row of panels for each marker
// and distance with a line for each estimator; of one estimator a row for each marker with a line
// for each distance.
void WriteCompareFigure(const std::string& path, const std::vector<CompareRow>& rows);

}  // namespace turbidock::estimators
