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

#include <cstdint>
#include <string>
#include <vector>

#include "experiments/studies/gate/judge.h"
#include "experiments/trial/scenario.h"
#include "sim/base/fields.h"

namespace turbidock::gate {

inline constexpr int kGateSchema = 1;
inline constexpr int kMaxTrials = 10000;  // of a condition

// What may never fail by chance more often than alpha. Bonferroni: alpha is divided by the number
// of tests in it.
enum class AlphaCovers { kGate, kCondition, kTest };
constexpr auto Names(AlphaCovers) {
  using enum AlphaCovers;
  return EnumList<AlphaCovers>({{kGate, "gate"}, {kCondition, "condition"}, {kTest, "test"}});
}

// The keys that a condition takes from the gate unless it has its own.
struct GateDefaults {
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

struct GateCondition : GateDefaults {
  std::string name;
  std::string scenario;

  static void Fields(auto& self, auto&& field) {
    field("name", self.name, Finite(), "what reports call it");
    field("scenario", self.scenario, Finite(), "a bundled scenario, or a file beside the gate's");
    GateDefaults::Fields(self, field);
  }

  // Read beside the fields.
  std::vector<std::string> assignments;  // from `set`: "water.milk_ml_m3=20"
  std::string scenario_file;             // where it was found
  std::string digest;                    // of the scenario file's content and the assignments
  trial::Plugins plugins;                // what else the scenario may choose

  // ConfigError for a scenario that cannot be loaded, or a seed among the assignments.
  trial::Scenario Load(const std::vector<std::string>& more_assignments, int64_t seed) const;
};

struct GatePlan : GateDefaults {
  int schema_version = 0;
  std::string description;
  int64_t seed = 1;
  std::string baseline;
  AlphaCovers alpha_covers = AlphaCovers::kGate;
  std::vector<GateCondition> conditions;
  // No keys: of the command line and the program.
  std::vector<std::string> assignments;  // in every scenario, over the conditions' own
  trial::Plugins plugins;

  static void Fields(auto& self, auto&& field) {
    field("schema_version", self.schema_version, InRange(kGateSchema, kGateSchema),
          "version of these keys");
    field("description", self.description, Finite(), "one line for people");
    field("seed", self.seed, AtLeast(0),
          "root of the trials' seeds; the baseline must have the same");
    field("baseline", self.baseline, Finite(), "the baseline's file, beside the gate's");
    GateDefaults::Fields(self, field);
    field("alpha_covers", self.alpha_covers, Finite(),
          "what alpha bounds the false alarms of: the whole gate, a condition, or one test");
    field("conditions", self.conditions, Finite(), "what must not get worse");
  }
  void Check(const std::string& path) const;

  JudgeOptions OptionsFor(const GateCondition& condition) const;  // how to judge it
  int64_t SeedOf(int trial) const;
};

// Reads a gate's file. ConfigError for whatever is wrong in it, also for a scenario that cannot be
// loaded.
GatePlan LoadGatePlan(const std::string& file, const trial::Plugins& plugins = {});

}  // namespace turbidock::gate
