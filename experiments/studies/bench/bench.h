#pragma once
// How fast the closed loop is, stage by stage, against MuJoCo's bare rendering of the same views.
//
// A bench runs a scenario's trial with a stopwatch, several times over. After every block of frames
// it stops the watch and draws some of the block's states as any user of MuJoCo would: mjr_render
// and mjr_readPixels of colour and depth, left and right camera, nothing else. Loop and bare
// rendering so take turns within a fraction of a second and share whatever else the machine does.
//
// Statistics against noise: of each block, the repeat with the median time; of the trial, the mean
// over its blocks.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "experiments/trial/scenario.h"
#include "sim/base/result_fields.h"
#include "sim/base/stage_timer.h"

namespace turbidock::bench {

struct BenchOptions {
  int frames = 600;  // of a trial, which may end earlier
  int repeats = 3;   // of the trial
  // Called every block, with the share done and words.
  std::function<void(double share, const std::string& words)> progress;
};

// Quartiles over all blocks of all repeats.
struct Quartiles {
  double low = 0, median = 0, high = 0;

  std::array<double, 3> AsList() const { return {low, median, high}; }
};

// Times of one scenario. A frame is both cameras' and everything that follows from it.
struct BenchResult {
  std::string scenario;  // its description
  std::string renderer;
  std::string digest;  // of the trial; the same in every repeat
  int64_t frames = 0;  // of the trial
  int repeats = 0;
  double frame_s = 0;
  StageTimer::Seconds stages_s{};  // add up to frame_s
  // Bare rendering of both views, at its cheapest: one sample a pixel, no shadows.
  double bare_s = 0;
  // And as the scene's file asks for it, samples and shadows included.
  double bare_as_modelled_s = 0;
  // The same of the thread's processor time: what other programs take does not count.
  double frame_cpu_s = 0, bare_cpu_s = 0;
  Quartiles ratio_to_bare;       // of neighbouring blocks
  double frame_period_s = 0;     // simulated
  double evaluations = 0;        // of the fitness, a frame
  double evaluations_per_s = 0;  // while the search runs (stage estimate)

  double ratio_to_bare_render() const { return frame_s / bare_s; }
  double real_time_factor() const { return frame_period_s / frame_s; }
};

// Needs the machine for itself. SimulatorFault when the repeats' digests differ.
BenchResult RunBench(const trial::Scenario& scenario, const BenchOptions& options);

// What a worker process costs before and beside its trials.
struct WorkerCost {
  double start_up_s = 0;       // from starting the program to its end after the first frame; median
  double peak_memory_mib = 0;  // resident, after two simulated seconds

  TURBIDOCK_FIELDS(start_up_s, peak_memory_mib)
};

// `program` is the path of the turbidock executable, `arguments` the scenario with its settings as
// `turbidock run` takes them.
WorkerCost MeasureWorker(const std::string& program, const std::vector<std::string>& arguments);

// Whole trials of the scenario, each in a process of its own on one core.
struct Throughput {
  std::string scenario;  // as given
  int workers = 0;
  int trials = 0;
  double wall_s = 0;  // until all had ended

  double trials_per_hour() const { return 3600 * trials / wall_s; }

  static void Fields(auto& self, auto&& field) {
    self.VisitFields(field);
    field("trials_per_hour", self.trials_per_hour());
  }
  TURBIDOCK_VISIT_FIELDS(scenario, workers, trials, wall_s)
};

// Runs as many trials side by side as there are workers, and this twice, after another.
Throughput MeasureThroughput(const std::string& program, const std::vector<std::string>& arguments,
                             int workers);

// The results as JSON text. Beside each scenario's own numbers, the same keys at the top are of all
// scenarios together, frame by frame.
struct BenchReport {
  std::vector<BenchResult> results;
  std::vector<WorkerCost> workers;      // one a result, or none
  std::vector<Throughput> throughputs;  // any number
};
std::string BenchJson(const BenchReport& report);
std::string BenchTable(const BenchReport& report);

}  // namespace turbidock::bench
