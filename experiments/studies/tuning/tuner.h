#pragma once
// Tunes gains: optimiser, racing, the incumbent, the proof at the end, and what is left of it:
// gains to use, and the evidence.

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/comparison.h"
#include "experiments/batch/runner.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/statistics/paired_tests.h"
#include "experiments/studies/tuning/study.h"
#include "experiments/system/output_path.h"
#include "sim/base/result_fields.h"

namespace turbidock::tuning {

// A candidate and its cost.
struct Tried {
  Gains gains;
  double cost = 0;
};

// What a generation brought.
struct GenerationRecord {
  int generation = 0;
  int candidates = 0, given_up = 0;
  int64_t trials = 0;            // evaluated so far
  double best = 0, median = 0;   // cost of its candidates
  double incumbent = 0;          // cost on the same trials, before the generation
  double incumbent_success = 0;  // share
  bool replaced = false;         // a candidate took the incumbent's place
  Gains gains{};                 // the incumbent's after it
  std::vector<Tried> tried{};

  TURBIDOCK_FIELDS(generation, candidates, given_up, trials, best, median, incumbent,
                   incumbent_success, replaced, gains)
};

// A term of the objective: what it costs a trial on average.
struct TermCost {
  std::string metric;
  double before = 0, tuned = 0;

  TURBIDOCK_FIELDS(metric, before, tuned)
};

// The tuned gains (b) against those that were there before (a), on held-out seeds.
struct HeldOut {
  statistics::PairedComparison cost_difference{};  // tuned less start
  std::vector<TermCost> terms{};
  std::vector<batch::Change> changes{};  // the success rate first

  TURBIDOCK_FIELDS(cost_difference, terms, changes)
};

struct TuningResult {
  Gains start, tuned;
  std::vector<GenerationRecord> generations;  // the start is the first
  std::optional<HeldOut> held_out;
  int64_t trials = 0, trials_run = 0;  // evaluated, and those of them that had to be run
  bool finished = false;               // with the proof

  // Those of the study's budget: the start is none.
  int search_generations() const {
    return std::max(0, static_cast<int>(std::ssize(generations)) - 1);
  }
};

struct TuningOptions {
  batch::JobOptions jobs = {};
  bool anew = false;  // of a file with trials of another study, scenario or program
  // After every trial: what is done, in words, and its share of the search or of the proof.
  std::function<void(const std::string& what, double share)> on_progress = nullptr;
  // What was found so far: at the beginning, after each generation, and at the end while the file
  // of trials is still held.
  std::function<void(const TuningResult&)> on_result = nullptr;
  std::function<bool()> stop_requested = nullptr;
};

// Runs a study and keeps its trials in `file`, or goes on with it. The result follows from the
// study and the build alone. Throws batch::Stopped when asked to, ConfigError when the start fails
// in every trial: there would be nothing to compare with.
TuningResult Tune(const Study& study, const std::string& file, const TuningOptions& options);

inline constexpr system::FileKind kGainsFile = {"gains file of tune",
                                                "# Found by `turbidock tune`"};

// A gains file for `run --gains`: the controller, its whole group, and every other tuned key.
std::string GainsYaml(const Study& study, const TuningResult& result);

// What the study found, or has found so far where it is not finished.
report::Report ReportOf(const Study& study, const TuningResult& result);

// The same in numbers, SI units, for the report's document (report/report_json.h).
report::Json TuningJson(const Study& study, const TuningResult& result);

}  // namespace turbidock::tuning
