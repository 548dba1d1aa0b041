#pragma once
// A gate: a plan (batch/plan.h) whose cells must not get worse, and in its group `gate` by how much
// and how sure the verdict is to be.
//
//   schema_version: 1
//   description: docking at night
//   scenario: sea_night_active
//   seeds: 100                              # trials of a condition at most
//   cases:                                  # the conditions: cells of the plan
//     calm: {}
//     moderate sea: {sea.state: moderate}
//   gate:
//     baseline: docking.baseline.yaml       # beside this file
//     alpha: 0.05                           # chance that this gate fails although nothing is worse
//     beta: 0.05                            # chance that it passes a condition worse by a margin
//     margins: {success_rate: 0.1, time_s: 5}   # of batch::kMeasures
//     never: [collision]                    # one such trial fails the gate at once
//     conditions:                           # what a condition has of its own
//       moderate sea: {max_trials: 60, margins: {success_rate: 0.15}}
//
// Where the plan has `ranges`, a condition is a whole envelope: its baseline looks for the
// boundary, and those very trials run again. margins: {area: 0.05} is the share of the ranges whose
// loss matters (envelope_gate.h).

#include <cstdint>
#include <string>
#include <vector>

#include "experiments/batch/comparison.h"
#include "experiments/batch/plan.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/trial/trial_record.h"
#include "sim/base/fields.h"

namespace turbidock::gate {

// What may never fail by chance more often than alpha. Bonferroni: alpha is divided by the number
// of tests in it.
enum class AlphaCovers { kGate, kCondition, kTest };
constexpr auto Names(AlphaCovers) {
  using enum AlphaCovers;
  return EnumList<AlphaCovers>({{kGate, "gate"}, {kCondition, "condition"}, {kTest, "test"}});
}

// How a condition is judged: keys that it takes from the gate unless it has its own.
struct ConditionSettings {
  double alpha = 0.05, beta = 0.05;
  int max_trials = 0;
  batch::Margins margins;
  std::vector<trial::Outcome> never;  // outcomes of which a single one fails the gate at once

  static void Fields(auto& self, auto&& field) {
    field("alpha", self.alpha, batch::TestedProbability(),
          "probability that the gate fails although nothing got worse (false alarm)");
    field("beta", self.beta, batch::TestedProbability(),
          "probability that a measure that is worse by its margin passes");
    field("max_trials", self.max_trials, InRange(0, 10000),
          "number of trials of a condition at most; 0: the plan's `seeds`");
    field("margins", self.margins, Finite(), "changes for the worse that matter to the gate");
  }
};

struct GateSettings : ConditionSettings {
  std::string baseline;
  AlphaCovers alpha_covers = AlphaCovers::kGate;

  static void Fields(auto& self, auto&& field) {
    field("baseline", self.baseline, Finite(),
          "file of the gate's baseline, beside the gate's own");
    ConditionSettings::Fields(self, field);
    field("alpha_covers", self.alpha_covers, Finite(),
          "scope of alpha, the bound of false alarms: the whole gate, a condition, or one test");
  }
};

struct Condition {
  std::string name;    // of the cell, or of all that differ in ranges: its case, "sea.state=calm"
  std::string given;   // what the plan gives its trials, for people
  std::string digest;  // of that and the content of the files that it names
  ConditionSettings settings{};
  double tests = 1;  // that share alpha

  batch::JudgeOptions options() const {
    return {.alpha = settings.alpha / tests,
            .beta = settings.beta,
            .max_trials = settings.max_trials,
            .margins = settings.margins};
  }
};

struct Gate {
  GateSettings settings;
  batch::Plan plan;
  std::vector<Condition> conditions;     // by cell / PlacesOf(plan)
  std::vector<std::string> assignments;  // of the command line: not the build as it is
};

// Cells of a condition: 1, or those of the lattice over a plan's ranges.
int64_t PlacesOf(const batch::Plan& plan);

// Reads a gate: a YAML file or the name of a bundled one. `given`, of the command line, counts over
// what the plan sets, as if the build had it so. ConfigError for whatever is wrong in it.
Gate LoadGate(const std::string& name, const trial::Plugins& plugins = {},
              const std::vector<config::Assignment>& given = {});

// The keys of the group `gate`.
std::vector<config::KeyDoc> GateKeys();

}  // namespace turbidock::gate
