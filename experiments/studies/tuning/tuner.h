#pragma once
// Tunes gains: optimiser, racing, the incumbent, and the proof at the end.

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/statistics/paired_tests.h"
#include "experiments/studies/tuning/evaluations.h"
#include "experiments/studies/tuning/study.h"
#include "sim/base/result_fields.h"

namespace turbidock::tuning {

// What a generation brought.
struct GenerationRecord {
  int generation = 0;
  int candidates = 0, given_up = 0;
  int64_t trials = 0;            // evaluated so far
  double best = 0, median = 0;   // worth of its candidates
  double incumbent = 0;          // worth on the same trials, before the generation
  double incumbent_success = 0;  // share
  bool replaced = false;         // a candidate took the incumbent's place
  // Sum over the replacements so far of how much less the new incumbent cost on the trials of its
  // challenge that were new to both: what the search gained, whichever seeds a generation had.
  double gained = 0;
  Gains gains{};  // the incumbent's after it

  TURBIDOCK_FIELDS(generation, candidates, given_up, trials, best, median, incumbent,
                   incumbent_success, replaced, gained, gains)
};

// One side of a comparison on held-out trials.
struct TrialSummary {
  int64_t trials = 0, successes = 0;
  statistics::Interval success{};  // Wilson, 95 %
  double cost = 0;                 // mean
  // medians over the successes
  std::optional<double> time_s = std::nullopt, error_y_m = std::nullopt, error_z_m = std::nullopt;

  static void Fields(auto& self, auto&& field) {
    field("trials", self.trials);
    field("successes", self.successes);
    field("success_95", self.success);
    field("cost_mean", self.cost);
    field("time_s_median", self.time_s);
    field("final_error_true_y_m_median", self.error_y_m);
    field("final_error_true_z_m_median", self.error_z_m);
  }
};

// `start` is what the proof compares with: the starting gains or the study's `against`.
struct Comparison {
  std::string what;  // "held out", "mass -30 %"
  TrialSummary start{}, tuned{};
  statistics::PairedComparison cost{};     // tuned less start
  statistics::PairedComparison time_s{};   // pairs in which both docked
  int64_t only_start = 0, only_tuned = 0;  // successes of one alone
  double mcnemar_p = 1;

  static void Fields(auto& self, auto&& field) {
    field("what", self.what);
    field("start", self.start);
    field("tuned", self.tuned);
    field("cost_difference", self.cost);
    field("time_difference_s", self.time_s);
    field("only_start_docked", self.only_start);
    field("only_tuned_docked", self.only_tuned);
    field("mcnemar_p", self.mcnemar_p);
  }
};

// How the cost answers when one gain leaves its tuned value.
struct Sensitivity {
  std::string key;
  double down = 0, up = 0;                              // values
  statistics::PairedComparison cost_down{}, cost_up{};  // less that of the tuned value

  TURBIDOCK_FIELDS(key, down, cost_down, up, cost_up)
};

struct ParetoPoint {
  Gains gains;
  search::Worth worth;
  double success = 0;

  TURBIDOCK_FIELDS(gains, worth, success)
};

struct TuningResult {
  Gains start, tuned;
  std::vector<GenerationRecord> generations;  // the start is the first
  std::vector<ParetoPoint> front;             // nsga2
  std::optional<Comparison> held_out;
  std::vector<Comparison> robustness;
  std::vector<Sensitivity> sensitivity;
  int64_t trials = 0, trials_run = 0;
  double wall_time_s = 0, worker_time_s = 0;
  bool finished = false;  // with the proof

  // Those of the study's budget: the start is none.
  int search_generations() const {
    return std::max(0, static_cast<int>(std::ssize(generations)) - 1);
  }
};

struct TuningProgress {
  std::string phase;
  double share = 0;  // of the generations, then of the proof
  int64_t trials = 0;
  double best = 0, best_success = 0;
};

struct TuningOptions {
  farm::FarmOptions farm = {};
  std::function<void(const TuningProgress&)> on_progress = nullptr;
  // What was found so far: at the beginning, after each generation and each part of the proof, and
  // at the end while the file of trials is still held.
  std::function<void(const TuningResult&)> on_result = nullptr;
  std::function<bool()> stop_requested = nullptr;
};

// The study found nothing to compare with: the start fails in every trial. Exit code 1.
struct HopelessStart : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Runs a study and keeps its trials in `file`, or goes on with it. The result follows from the
// study and the build alone. Throws Stopped when asked to.
TuningResult Tune(const Study& study, const std::string& file, const TuningOptions& options);

// What a robustness table changes in a scenario.
struct Variation {
  std::string name;
  std::function<void(trial::Scenario*)> change;
};
const std::vector<Variation>& Variations();

}  // namespace turbidock::tuning
