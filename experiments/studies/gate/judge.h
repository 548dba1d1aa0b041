#pragma once
// The verdict on one condition: its trials, one after another, against the baseline's.
//
// Measured are the success rate and, on trials that docked, what Quality has. Each has a margin,
// the change for the worse that matters, and two one-sided tests (sequential_test.h): one rejects
// "no worse" and fails, the other rejects "worse by the margin" and passes.
//
// Trials are compared with the baseline's of the same seeds, in pairs:
//  - success rate: of the pairs in which one build docked and the other did not, "no worse" says
//    that at most half are losses (McNemar's test, sequential); NetLossTest passes;
//  - the others, in pairs that docked in both: "no worse" says that of the pairs that differ at
//    most half are worse; "worse by the margin" says that at most half are less than the margin
//    worse (two sequential sign tests, of the median difference). Where beta exceeds a test's share
//    of alpha, as it does by default, the second needs fewer pairs: what makes every trial worse by
//    less than the margin passes.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/statistics/intervals.h"
#include "experiments/statistics/sequential_test.h"
#include "experiments/trial/trial_record.h"
#include "sim/base/fields.h"
#include "sim/base/result_fields.h"

namespace turbidock::gate {

// How well a trial docked; as margins, how much worse each of its medians may get.
struct Quality {
  double time_s = 0;               // when the docking criterion was met, else of the end
  double final_error_m = 0;        // true distance from the desired position at that time
  double returns_to_servoing = 0;  // from docking, how often
  double fitness = 0;              // F, mean over all frames
  double effort_v = 0;             // root mean square of the commands about neutral
};

// Of a trial that came to an end of its own.
Quality QualityOf(const trial::TrialRecord& record);

// What is judged of it: the list that margins, judge and baseline follow.
struct MedianMeasure {
  const char* name;
  const char* unit;
  double Quality::*value;
  double sign = 1;  // of a change for the worse: -1 where less is worse
};
inline constexpr std::array<MedianMeasure, 5> kMedianMeasures = {{
    {"time to dock", "s", &Quality::time_s},
    {"final true error", "m", &Quality::final_error_m},
    {"returns to servoing", "times", &Quality::returns_to_servoing},
    {"fitness", "F", &Quality::fitness, -1},
    {"effort", "V", &Quality::effort_v},
}};

// What the gate needs of a trial.
struct GateTrial {
  int64_t seed = 0;
  trial::Outcome outcome = trial::Outcome::kTimeout;
  Quality quality;
  std::string digest;

  bool docked() const { return outcome == trial::Outcome::kDocked; }

  static void Fields(auto& self, auto&& field) {
    field("seed", self.seed, AtLeast(0), "of the trial");
    field("outcome", self.outcome, Finite(), "how it ended");
    field("time_s", self.quality.time_s, AtLeast(0), "when it docked or ended");
    field("final_error_m", self.quality.final_error_m, AtLeast(0),
          "true distance from the desired pose");
    field("returns_to_servoing", self.quality.returns_to_servoing, AtLeast(0), "from docking");
    field("fitness", self.quality.fitness, Finite(), "F, mean over all frames");
    field("effort_v", self.quality.effort_v, AtLeast(0), "root mean square of the commands");
    field("digest", self.digest, Finite(), "of the trial");
  }
};

// Of error rates and of what a success rate may lose: what the tests are exact for.
inline Range TestedProbability() {
  return InRange(statistics::kLeastProbability, 1 - statistics::kLeastProbability);
}

// The changes for the worse that matter. Zero: not judged.
struct GateMargins {
  double success_rate = 0.1;
  Quality median;  // all positive, also where less is worse

  static void Fields(auto& self, auto&& field) {
    field("success_rate", self.success_rate, TestedProbability(),
          "loss of success rate that matters");
    field("time_s", self.median.time_s, AtLeast(0),
          "increase of the median time to dock that matters; 0: not judged");
    field("final_error_m", self.median.final_error_m, AtLeast(0),
          "increase of the median final true error that matters; 0: not judged");
    field("returns_to_servoing", self.median.returns_to_servoing, AtLeast(0),
          "increase of the median of returns from docking to servoing that matters; 0: not judged");
    field("fitness", self.median.fitness, AtLeast(0),
          "decrease of the median of the trials' mean F that matters; 0: not judged");
    field("effort_v", self.median.effort_v, AtLeast(0),
          "increase of the median effort that matters; 0: not judged");
  }

  int tests() const;
};

// Of the trials that docked.
std::optional<double> DockedMedian(const std::vector<GateTrial>& trials, double Quality::*value);

struct JudgeOptions {
  GateMargins margins;
  double alpha = 0.05, beta = 0.05;  // of each measure's test
  int max_trials = 200;
};

// What the success rate's test can tell, exactly: of a build that does as the old one but for what
// it loses.
struct TestSize {
  double margin = 0, alpha = 0, beta = 0;
  int max_trials = 0;
  double unchanged_trials = 0;              // after which a build without change passes
  bool passes_unchanged = true;             // at all
  double worse_fails = 0;                   // probability that one worse by the margin fails
  std::optional<double> least_loss_seen{};  // of success rate: fails with a probability of 0.8

  TURBIDOCK_FIELDS(margin, alpha, beta, max_trials, unchanged_trials, passes_unchanged, worse_fails,
                   least_loss_seen)
};
TestSize SizeOf(const JudgeOptions& options);

// One measure of a condition.
struct MeasureReport {
  std::string measure;  // "success rate", or one of kMedianMeasures
  std::string unit;     // "" of the success rate
  statistics::Verdict verdict = statistics::Verdict::kInconclusive;
  std::optional<int> decided_after_trials{};
  bool less_is_worse = false;
  double margin = 0;
  std::optional<double> before{}, now{};  // rate or median
  int compared = 0;                       // pairs
  int worse = 0, better = 0;              // of these

  TURBIDOCK_FIELDS(measure, unit, verdict, decided_after_trials, less_is_worse, margin, before, now,
                   compared, worse, better)
};

// Where the test of the success rate stands after some of the trials, or will after more of them.
struct Look {
  int trials = 0;
  std::optional<int> worse = std::nullopt;  // counted; nothing of trials that were not run
  // It fails at so many that are worse, or passes at so few, with the better ones that there are;
  // nothing where no number would do.
  std::optional<int> fails_at = std::nullopt, passes_at = std::nullopt;

  TURBIDOCK_FIELDS(trials, worse, fails_at, passes_at)
};

struct ConditionReport {
  std::string name;
  statistics::Verdict verdict = statistics::Verdict::kInconclusive;
  std::vector<GateTrial> trials;  // that the verdict rests on, in their order
  int docked = 0;
  statistics::Interval interval_95;  // of the success rate, Wilson, 95 %
  int baseline_trials = 0, baseline_docked = 0;
  statistics::Interval baseline_interval_95;
  TestSize test;
  std::vector<MeasureReport> measures;
  std::vector<int64_t> newly_failing_seeds, newly_docking_seeds;
  std::vector<Look> path;  // of the success rate's test, up to the last trial allowed

  static void Fields(auto& self, auto&& field) {
    field("condition", self.name);
    field("verdict", self.verdict);
    field("trials", self.trials.size());
    self.VisitFields(field);
    field("outcomes", self.trials);
  }
  TURBIDOCK_VISIT_FIELDS(docked, interval_95, baseline_trials, baseline_docked,
                         baseline_interval_95, test, measures, newly_failing_seeds,
                         newly_docking_seeds, path)
};

class ConditionJudge {
 public:
  // ConfigError when the baseline docks too rarely to get worse by the margin.
  ConditionJudge(std::string name, const JudgeOptions& options,
                 const std::vector<GateTrial>& baseline);

  // Counts the next trial, whose seed must be one of the baseline's. Ignored once done.
  void Add(const GateTrial& trial);
  // Something is worse, everything is known, or the trials allowed are spent.
  bool done() const { return done_; }
  int trials() const { return static_cast<int>(report_.trials.size()); }
  int wanted() const { return done_ ? trials() : options_.max_trials; }  // as far as is known
  ConditionReport Report() const;

 private:
  // A median under test.
  struct Median {
    MedianMeasure of;
    MeasureReport report;
    statistics::SignTest fail, pass;
    int equal = 0, within_margin = 0;  // counted besides what is reported
  };

  void Count(const GateTrial& before, const GateTrial& now);
  std::vector<Look> Path() const;

  JudgeOptions options_;
  std::map<int64_t, GateTrial> baseline_;  // by seed
  statistics::PairedRateTest rate_test_;
  MeasureReport rate_;
  std::vector<Median> medians_;
  ConditionReport report_;
  bool done_ = false;
};

}  // namespace turbidock::gate
