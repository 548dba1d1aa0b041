#pragma once
// A gate: which conditions must not get worse, by how much, and how sure the verdict is to be.
//
//   schema_version: 1
//   description: docking at night
//   baseline: docking.baseline.yaml       # beside this file
//   alpha: 0.05                           # chance that this gate fails although nothing is worse
//   beta: 0.05                            # chance that it passes a condition worse by a margin
//   max_trials: 100                       # of each condition
//   margins: {success_rate: 0.1, time_s: 5, final_error_m: 0.02}   # see GateMargins
//   conditions:
//     - name: calm
//       scenario: sea_night_active        # a bundled scenario, or a file beside this one
//     - name: moderate sea
//       scenario: sea_night_active
//       set: {sea.state: moderate}        # scenario keys
//       margins: {success_rate: 0.15}     # alpha, beta, max_trials, margins: else the gate's

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "experiments/config/yaml_node.h"
#include "experiments/statistics/sequential_test.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial_record.h"
#include "sim/base/fields.h"

namespace turbidock::gate {

inline constexpr int kGateSchema = 1;
inline constexpr int kMaxTrials = 10000;  // of a condition

// What is judged besides the success rate, of trials that docked: the list that margins, baseline
// and judge follow.
struct MedianMeasure {
  const char* key;  // in margins and baselines
  const char* name;
  const char* unit;
  double (*of)(const trial::TrialRecord& record);
  double sign = 1;  // of a change for the worse: -1 where less is worse
};
inline constexpr auto kMedianMeasures = std::to_array<MedianMeasure>(
    {{"time_s", "time to dock", "s", [](const auto& r) { return r.time_s; }},
     {"final_error_m", "final true error", "m",
      [](const auto& r) { return r.final_error_true.distance_m(); }},
     {"returns_to_servoing", "returns to servoing", "times",
      [](const auto& r) { return static_cast<double>(r.returns_to_servoing); }},
     {"fitness", "fitness", "F", [](const auto& r) { return r.fitness_mean; }, -1},
     {"effort_v", "effort", "V", [](const auto& r) { return r.effort_v; }},
     {"false_confidence_s", "false confidence", "s",
      [](const auto& r) { return r.false_confidence_s; }}});
using MedianValues = std::array<double, kMedianMeasures.size()>;
// Of trials measured before there was the measure.
inline constexpr double kNotMeasured = -1;

// Of error rates and of what a success rate may lose: what the tests are exact for.
inline Range TestedProbability() {
  return InRange(statistics::kLeastProbability, 1 - statistics::kLeastProbability);
}

// The changes for the worse that matter. Zero: not judged.
struct GateMargins {
  double success_rate = 0.1;
  MedianValues medians{};  // none negative, also where less is worse

  static void Fields(auto& self, auto&& field) {
    field("success_rate", self.success_rate, TestedProbability(),
          "loss of success rate that matters");
    for (size_t i = 0; i < kMedianMeasures.size(); ++i)
      field(kMedianMeasures[i].key, self.medians[i], AtLeast(0),
            "change of its median for the worse that matters; 0: not judged");
  }

  int tests() const {
    return 1 + static_cast<int>(medians.size() - std::ranges::count(medians, 0));
  }
};

// What may never fail by chance more often than alpha. Bonferroni: alpha is divided by the number
// of tests in it.
enum class AlphaCovers { kGate, kCondition, kTest };
constexpr auto Names(AlphaCovers) {
  using enum AlphaCovers;
  return EnumList<AlphaCovers>({{kGate, "gate"}, {kCondition, "condition"}, {kTest, "test"}});
}

// How a condition is judged: keys that it takes from the gate unless it has its own.
struct JudgeOptions {
  double alpha = 0.05, beta = 0.05;
  int max_trials = 100;
  GateMargins margins;

  static void Fields(auto& self, auto&& field) {
    field("alpha", self.alpha, TestedProbability(), "chance of a false alarm");
    field("beta", self.beta, TestedProbability(),
          "chance that a measure that is worse by its margin passes");
    field("max_trials", self.max_trials, InRange(1, kMaxTrials), "trials of a condition at most");
    field("margins", self.margins, Finite(), "changes for the worse that matter");
  }
};

struct GateCondition : JudgeOptions {
  std::string name;
  std::string scenario;

  static void Fields(auto& self, auto&& field) {
    field("name", self.name, Finite(), "what reports call it");
    field("scenario", self.scenario, Finite(), "a bundled scenario, or a file beside the gate's");
    JudgeOptions::Fields(self, field);
  }

  // Read beside the fields.
  std::vector<std::string> keys;  // of `set`
  std::string settings;           // that, for people
  std::string scenario_file;      // where it was found
  std::string digest;             // of the scenario file's content and the settings
  trial::Scenario resolved;       // with all that is set; its trials differ in the seed
};

struct GatePlan : JudgeOptions {
  int schema_version = 0;
  std::string description;
  int64_t seed = 1;
  std::string baseline;
  AlphaCovers alpha_covers = AlphaCovers::kGate;
  std::vector<GateCondition> conditions;
  // No key: of the command line, in every scenario, over the conditions' own.
  std::vector<std::string> assignments;

  static void Fields(auto& self, auto&& field) {
    field("schema_version", self.schema_version, InRange(kGateSchema, kGateSchema),
          "version of these keys");
    field("description", self.description, Finite(), "one line for people");
    field("seed", self.seed, AtLeast(0),
          "root of the trials' seeds; the baseline must have the same");
    field("baseline", self.baseline, Finite(), "the baseline's file, beside the gate's");
    JudgeOptions::Fields(self, field);
    field("alpha_covers", self.alpha_covers, Finite(),
          "what alpha bounds the false alarms of: the whole gate, a condition, or one test");
    field("conditions", self.conditions, Finite(), "what must not get worse");
  }
  void Check(const std::string& path) const;

  // How to judge it, with its tests' share of alpha.
  JudgeOptions OptionsFor(const GateCondition& condition) const;
  int64_t SeedOf(int trial) const;
};

trial::Scenario ScenarioOf(const GateCondition& condition, int64_t trial_seed);

// Reads a gate's file and its scenarios; nothing is read again later. `given`: of the command line.
// ConfigError for whatever is wrong in it, also for a scenario that cannot be loaded.
GatePlan LoadGatePlan(const std::string& file, const trial::Plugins& plugins = {},
                      const std::vector<config::Assignment>& given = {});

}  // namespace turbidock::gate
