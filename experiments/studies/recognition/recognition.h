#pragma once
// The recognition experiment: a vehicle at rest looks at the marker, from where a plan's trial
// begins; how well the marker is recognised is the mean of F over a minute. The published one, of
// milk that is added step by step, is in the plans recognition_active and recognition_passive.
//
// F is that of the scenario's estimator as it tracks, by default of the best individual after the
// generations of one frame, as in the published rig, whose search runs on the stream of images
// without end. It has run for `settle_s` before a cell's first frame counts, and begins knowing
// nothing.

#include <functional>
#include <string>
#include <vector>

#include "experiments/batch/job_pool.h"
#include "experiments/batch/plan.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/trial/fixed_view.h"
#include "experiments/trial/scenario.h"
#include "sim/base/random.h"
#include "sim/base/result_fields.h"
#include "sim/base/units.h"

namespace turbidock::recognition {

enum class MarkerKind { kActive, kPassive };
constexpr auto Names(MarkerKind) {
  using enum MarkerKind;
  return EnumList<MarkerKind>({{kActive, "active"}, {kPassive, "passive"}});
}

// What a mean F allows: docking, recognition, nothing. Limits: ViewCriteria.
enum class Area { kI, kII, kIII };
constexpr auto Names(Area) {
  using enum Area;
  return EnumList<Area>({{kI, "I"}, {kII, "II"}, {kIII, "III"}});
}
Area AreaOf(double fitness_mean);

// One point of the experiment.
struct RecognitionCell {
  MarkerKind marker = MarkerKind::kActive;
  double milk_ml_m3 = 0;
  double distance_m = 0;  // from the camera head to the marker's origin, straight ahead

  // NOLINTNEXTLINE(modernize-use-nullptr): what comparisons with it make of the default
  auto operator<=>(const RecognitionCell&) const = default;
  TURBIDOCK_FIELDS(marker, milk_ml_m3, distance_m)
};

struct CellResult {
  RecognitionCell cell;
  int64_t trial = 0;      // of the plan
  std::string name = {};  // its cell of the plan's grid, without the milk
  double fitness_mean = 0, fitness_std = 0;
  Area area = Area::kIII;
  double position_error_mean_m = 0;  // distance of the estimated origin from the true one
  // Shares of the frames in which the marker is detected: within 20 mm and 5 degrees, or not.
  double right = 0, wrong_and_sure = 0;
  std::vector<float> fitness = {};  // of every frame that counts
  Pose last_X_HM = {};              // the last frame's estimate

  static void Fields(auto& self, auto&& field) {
    field("marker", self.cell.marker);
    field("milk_ml_m3", self.cell.milk_ml_m3);
    field("distance_mm", units::MmFromM(self.cell.distance_m));
    field("trial", self.trial);
    field("name", self.name);
    self.VisitFields(field);
  }
  TURBIDOCK_VISIT_FIELDS(fitness_mean, fitness_std, area, position_error_mean_m, right,
                         wrong_and_sure)
};

// Sets mean, deviation, Area and the frames' F themselves. At least one frame.
void SetFitness(std::vector<float> fitness, CellResult* result);

// The calibration's scenario: the pool with that marker (bundled scenarios pool_active,
// pool_passive), without the station and with the published optics, under these assignments.
// ConfigError where it has no cameras.
trial::Scenario RecognitionScenario(MarkerKind marker, const std::vector<std::string>& assignments,
                                    const trial::Plugins& plugins = {});

// What a plan's trial is a cell of; distances to 0.1 mm.
RecognitionCell CellOf(const trial::Scenario& scenario);

// What the cameras have before them in a cell, without light, the water about it, which is the same
// at every distance, and the cameras in front of it, which hold it. Randomness depends on the
// scenario's seed and the cell only.
trial::FixedView ViewOf(const trial::Scenario& scenario, const RecognitionCell& cell);
light::Water WaterOf(const trial::FixedView& view, trial::Scenario scenario,
                     const RecognitionCell& cell);
SeedTree SeedsOf(const trial::Scenario& scenario, const RecognitionCell& cell);
camera::StereoCamera CamerasOf(const trial::FixedView& view, light::Water water,
                               const trial::Scenario& scenario, const RecognitionCell& cell);

struct RecognitionOptions {
  double seconds = 60;
  double settle_s = 5;    // before it counts: to find the marker from anywhere
  std::string file = {};  // where results are kept, and found again; empty: nowhere
  batch::JobOptions jobs = {};
  std::function<void(int done, int of)> on_progress = {};  // trials
  std::function<bool()> stop_requested = {};
};

// Keys of a plan that the experiment cannot take (PlanOverrides::refused).
std::vector<batch::PlanKey> RefusedKeys();

// A result for each trial of the plan, the same whoever does them and after any interruption.
// Nothing when it was stopped. ConfigError for a trial without cameras, and for a file of another
// plan, build or time.
std::vector<CellResult> Recognize(const batch::Plan& plan, const RecognitionOptions& options);

// Runs a trial: the work of a task. `plugins`: the scenario's.
batch::Work CellWork(const trial::Plugins& plugins);

// As a report and for programs, beside tables of any markers (table.h).
struct TableRow;

// Kind "recognition", after the published figures: how far and how turbid it may be, F over milk,
// Areas, and F by milk and the plan's other cells. Several trials of a cell are one.
report::Report ReportOf(const std::vector<CellResult>& results,
                        const std::vector<TableRow>& tables);

// The study's own keys: README.md.
report::Json ResultJson(const std::vector<CellResult>& results,
                        const std::vector<TableRow>& tables);

// What the cameras see, after the published Figs. 11 and 13: left and right images of a trial's
// last frame with the estimated marker, five steps of milk across at most, the plan's other cells
// down, as a PNG. The marker's results only. Contrast is stretched, of all images alike.
// ConfigError when the path cannot be written.
void WriteImageSheet(const std::string& path, const batch::Plan& plan, MarkerKind marker,
                     const std::vector<CellResult>& results);

}  // namespace turbidock::recognition
