#pragma once
// A study: which gains to tune, on which trials, for what. It is a plan (batch/plan.h), whose
// trials a candidate runs, with the group `tuning`. Everything that a tuning run does follows from
// it.
//
//   schema_version: 1
//   description: pid gains for the moderate sea
//   scenario: sea_night_active
//   set: {control.use: pid, sea.state: moderate}
//   seeds: 12
//   tuning:
//     gains:                         # the search begins at the values that the trials have
//       - {key: control.pid.sway.kp_per_s2, low: 0.2, high: 10, scale: log}
//     objective:                     # a trial costs the sum of weight * |metric|
//       - {metric: time_s, weight: 1, failed: 60}
//       - {metric: tracking_rms_m, weight: 500}
//     optimiser: {population: 12, generations: 20}

#include <cstdint>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/config/yaml_node.h"
#include "experiments/search/optimiser.h"
#include "experiments/trial/record_columns.h"
#include "sim/base/fields.h"

namespace turbidock::tuning {

// No weight is larger and no metric counts more: costs, their sums and the squares of their
// differences are finite.
inline constexpr double kMostCost = 1e9;

enum class Scale { kLinear, kLog };
constexpr auto Names(Scale) {
  using enum Scale;
  return EnumList<Scale>({{kLinear, "linear"}, {kLog, "log"}});
}

struct GainRange {
  std::string key;
  double low = 0, high = 1;
  Scale scale = Scale::kLinear;

  static void Fields(auto& self, auto&& field) {
    field("key", self.key, Finite(),
          "key of a number of the scenario that is tuned, such as control.pid.sway.kp_per_s2");
    field("low", self.low, Finite(), "lower end of the tuned key's range [unit of the key]");
    field("high", self.high, Finite(), "upper end of the tuned key's range [unit of the key]");
    field("scale", self.scale, Finite(),
          "scale on which the tuned key's range is searched; log for gains that differ by factors");
  }
  double ValueAt(double u) const;  // u in [0, 1]
  double ShareOf(double value) const;
};

// What a trial costs. A metric that a trial does not have counts 0.
struct ObjectiveTerm {
  std::string metric;
  double weight = 1;
  double failed = 0;

  static void Fields(auto& self, auto&& field) {
    field("metric", self.metric, Finite(),
          "metric of a trial, as batch stores it, whose size costs");
    field("weight", self.weight, Range{.low = 0, .high = kMostCost, .low_open = true},
          "factor on the metric's size: cost of one unit of it");
    field("failed", self.failed, InRange(0, kMostCost),
          "penalty that a trial without success has on top of its metric [unit of the metric]");
  }
};

// After `first` trials and then every `every` ones, a candidate is given up when its cost is higher
// than the incumbent's on the same trials with this confidence: one-sided paired t test, divided
// among the looks (Bonferroni).
struct RacingParams {
  int first = 4;
  int every = 4;
  double confidence = 0.99;

  static void Fields(auto& self, auto&& field) {
    field("first", self.first, InRange(2, 1e6),
          "number of trials of a candidate before racing first looks whether to give it up");
    field("every", self.every, InRange(1, 1e6),
          "number of trials of a candidate between racing's looks");
    field("confidence", self.confidence, InRange(0.5, 0.999999),
          "probability, at least, that a candidate given up is worse than the incumbent");
  }
};

// What compares the tuned gains with the starting ones, on seeds never used before.
struct ProofParams {
  int held_out_seeds = 200;
  bool cameras = true;

  static void Fields(auto& self, auto&& field) {
    field("held_out_seeds", self.held_out_seeds, InRange(2, 1e6),
          "number of new trials in each cell that compare the tuned gains with the starting ones");
    field("cameras", self.cameras, Finite(),
          "whether the vehicle sees through the cameras in the proof, whatever the search saw");
  }
};

struct TuningSettings {
  std::vector<GainRange> gains;
  std::vector<ObjectiveTerm> objective;
  double success_at_least = 0;
  double success_weight = 1000;
  bool start_may_fail = false;
  search::OptimiserParams optimiser;
  RacingParams racing;
  ProofParams proof;

  static void Fields(auto& self, auto&& field) {
    field("gains", self.gains, Finite(),
          "keys that are tuned, from the value that the trials have: the scenario's, or that of "
          "`set`");
    field("objective", self.objective, Finite(), "terms whose sum is what a trial costs");
    field(
        "success_at_least", self.success_at_least, InRange(0, 1),
        "share of trials that must succeed; below it a candidate pays success_weight for the rest");
    field("success_weight", self.success_weight, InRange(0, kMostCost),
          "factor on the missing share of successes: cost of a share of 1");
    field("start_may_fail", self.start_may_fail, Finite(),
          "whether tuning goes on though the starting gains fail in every trial");
    field("optimiser", self.optimiser, Finite(),
          "search for the gains: how many candidates, and how far apart");
    field("racing", self.racing, Finite(), "racing: when a candidate is given up early");
    field("proof", self.proof, Finite(), "proof: how the tuned gains are compared at the end");
  }
  void Check(const std::string& path) const;
};

// Values of the tuned gains, in the study's order.
using Gains = std::vector<double>;

class Study {
 public:
  // ConfigError for whatever is wrong in it.
  explicit Study(const config::YamlNode& study, const trial::Plugins& plugins = {});

  const TuningSettings& settings() const { return settings_; }
  const Gains& start() const { return start_; }  // the values that its trials have
  const batch::Plan& plan() const { return plan_; }

  Gains GainsAt(const search::Candidate& candidate) const;
  search::Candidate CandidateOf(const Gains& gains) const;

  // Trials of the study with seeds of their own: `set` 0 is the study's, every other one is drawn.
  // ConfigError for a number of seeds that it cannot have.
  batch::Plan TrialsOf(uint64_t set, int seeds) const;
  // A trial's scenario under these gains; through the cameras, whatever the study says, if
  // `cameras`.
  trial::Scenario ScenarioOf(const batch::Plan& plan, int64_t trial, const Gains& gains,
                             bool cameras = false) const;

  // Cost of a trial, term by term, weighted.
  std::vector<double> CostsOf(const trial::TrialRecord& record) const;

  // A study itself, of the same trials.
  std::string resolved() const;
  std::string hash() const { return DigestOf(resolved()); }

 private:
  void ReadObjective(const config::YamlNode& terms);
  void ReadGains(const config::YamlNode& ranges);

  std::string file_;
  batch::Plan plan_;
  TuningSettings settings_;
  std::vector<trial::Metric> objective_;  // what its terms name
  Gains start_;
};

// The keys of a study that a plan does not have.
std::vector<config::KeyDoc> StudyKeys();

// Reads a study: a YAML file or the name of a bundled one.
Study LoadStudy(const std::string& name, const trial::Plugins& plugins = {});

}  // namespace turbidock::tuning
