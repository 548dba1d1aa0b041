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

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/trial/scenario.h"
#include "sim/base/stage_timer.h"

namespace turbidock::bench {

struct BenchOptions {
  int frames = 600;  // of a trial, which may end earlier
  int repeats = 3;   // of the trial
  std::function<void(int done)> on_repeat = {};
};

// Sums over frames of a trial.
struct Times {
  int64_t frames = 0;
  int64_t seen = 0;  // of them, with a usable estimate: others search a whole image
  double simulated_s = 0;
  StageTimer::Seconds stages_s{};
  double bare_s = 0;  // bare rendering of both views
  double evaluations = 0;

  double frame_s() const;  // both cameras' and everything that follows from it: all stages
};

// By repeat, blocks in their order in the trial, or in the trials one after the other.
using Repeats = std::vector<std::vector<Times>>;

// Of all frames, each block as in its median repeat.
Times MedianTimes(const Repeats& repeats);

struct BenchResult {
  std::string scenario;  // its description
  std::string renderer;
  std::string digest = {};  // of the trial; the same in every repeat
  Repeats repeats = {};
};

// Needs the machine for itself. SimulatorFault when the repeats' digests differ.
BenchResult RunBench(const trial::Scenario& scenario, const BenchOptions& options);

// The study's own keys: those of all scenarios together, every frame counting the same, and of each
// in `scenarios`.
report::Json ResultJson(const std::vector<BenchResult>& results);
// Kind "bench", of that.
report::Report ReportOf(const report::Json& result);

}  // namespace turbidock::bench
