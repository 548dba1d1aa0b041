#pragma once
// How fast the closed loop is, stage by stage, against MuJoCo's bare rendering of the same views.
//
// A bench runs a scenario's trial with a stopwatch, several times over. After every block of frames
// it stops the watch and draws some of the block's states as any user of MuJoCo would: mjr_render
// and mjr_readPixels of colour and depth, left and right camera, nothing else. Loop and bare
// rendering so take turns within a fraction of a second and share whatever else the machine does.
//
// Statistics against noise: of each block, the repeat with the median time; of a trial, the mean
// over its blocks.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/report/report.h"
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

// Neighbouring frames of a trial; times are of one of them.
struct Block {
  int frames = 0;
  double frame_period_s = 0;  // simulated
  StageTimer::Seconds stages_s{};
  double frame_s = 0;  // both cameras' and everything that follows from it: all stages
  double bare_s = 0;   // bare rendering of both views
  double evaluations = 0;
};

// Quartiles over all blocks of all repeats.
struct Quartiles {
  double low = 0, median = 0, high = 0;

  std::array<double, 3> AsList() const { return {low, median, high}; }
};

// Times of a frame, as of Block.
struct Times {
  int64_t frames = 0;  // of the trials
  double frame_s = 0;
  StageTimer::Seconds stages_s{};  // add up to frame_s
  double bare_s = 0;
  Quartiles ratio_to_bare;  // of neighbouring blocks
  double frame_period_s = 0;
  double evaluations = 0;        // of the fitness
  double evaluations_per_s = 0;  // while the search runs (stage estimate)

  double ratio_to_bare_render() const { return frame_s / bare_s; }
  double real_time_factor() const { return frame_period_s / frame_s; }
};

// By repeat, blocks in their order in the trial, or in the trials one after the other.
using Repeats = std::vector<std::vector<Block>>;
Times TimesOf(const Repeats& repeats);

struct BenchResult {
  std::string scenario;  // its description
  std::string renderer;
  std::string digest = {};  // of the trial; the same in every repeat
  Repeats repeats = {};
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

// Kind "bench", and the study's own keys: those of all scenarios together, every frame counting the
// same, and of each in `scenarios`. `workers` are as many as results.
report::Report ReportOf(const std::vector<BenchResult>& results,
                        const std::vector<WorkerCost>& workers);
report::Json ResultJson(const std::vector<BenchResult>& results,
                        const std::vector<WorkerCost>& workers);

}  // namespace turbidock::bench
