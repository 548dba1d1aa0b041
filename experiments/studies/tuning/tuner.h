#pragma once
// Tunes gains: optimiser, racing, the incumbent, the proof at the end, and what is left of it:
// gains to use, and the evidence.

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/statistics/paired_tests.h"
#include "experiments/studies/tuning/evaluations.h"
#include "experiments/studies/tuning/study.h"
#include "experiments/system/output_path.h"
#include "sim/base/result_fields.h"

namespace turbidock::tuning {

// Of the trials of one set of gains.
struct TrialSummary {
  int64_t trials = 0, successes = 0;
  statistics::Interval success_95{};  // Wilson
  double cost_mean = 0;
  std::vector<double> cost_by_term{};  // means, in the objective's order
  // Medians over the successes.
  std::optional<double> time_s_median = std::nullopt, final_error_true_y_m_median = std::nullopt,
                        final_error_true_z_m_median = std::nullopt;

  TURBIDOCK_FIELDS(trials, successes, success_95, cost_mean, cost_by_term, time_s_median,
                   final_error_true_y_m_median, final_error_true_z_m_median)
};

// What a generation brought.
struct GenerationRecord {
  int generation = 0;
  int candidates = 0, given_up = 0;
  int64_t trials = 0;            // evaluated so far
  double best = 0, median = 0;   // cost of its candidates
  double incumbent = 0;          // cost on the same trials, before the generation
  double incumbent_success = 0;  // share
  TrialSummary incumbent_trials{};
  bool replaced = false;  // a candidate took the incumbent's place
  // Sum over the replacements so far of how much less the new incumbent cost on the trials of its
  // challenge that were new to both: what the search gained, whichever seeds a generation had.
  double gained = 0;
  Gains gains{};  // the incumbent's after it

  TURBIDOCK_FIELDS(generation, candidates, given_up, trials, best, median, incumbent,
                   incumbent_success, incumbent_trials, replaced, gained, gains)
};

struct Comparison {
  TrialSummary start{}, tuned{};
  statistics::PairedComparison cost_difference{};    // tuned less start
  statistics::PairedComparison time_difference_s{};  // pairs in which both docked
  int64_t only_start_docked = 0, only_tuned_docked = 0;
  double mcnemar_p = 1;

  TURBIDOCK_FIELDS(start, tuned, cost_difference, time_difference_s, only_start_docked,
                   only_tuned_docked, mcnemar_p)
};

struct TuningResult {
  Gains start, tuned;
  std::vector<GenerationRecord> generations;  // the start is the first
  std::optional<Comparison> held_out;
  int64_t trials = 0, trials_run = 0;
  double wall_time_s = 0, worker_time_s = 0;
  bool finished = false;  // with the proof

  // Those of the study's budget: the start is none.
  int search_generations() const {
    return std::max(0, static_cast<int>(std::ssize(generations)) - 1);
  }
};

struct TuningOptions {
  batch::JobOptions jobs = {};
  // A share of the generations, and the trials so far.
  std::function<void(const std::string& phase, double share, int64_t trials)> on_progress = nullptr;
  // What was found so far: at the beginning, after each generation, and
  // at the end while the file of trials is still held.
  std::function<void(const TuningResult&)> on_result = nullptr;
  std::function<bool()> stop_requested = nullptr;
};

// Runs a study and keeps its trials in `file`, or goes on with it. The result follows from the
// study and the build alone. Throws Stopped when asked to, ConfigError when the start fails in
// every trial: there would be nothing to compare with.
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
