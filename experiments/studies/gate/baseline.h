#pragma once
// The baseline of a gate: how every condition fared, a line a trial, in a YAML file to be
// committed. It is made by a gate run with --update and never by hand: a checksum over the text
// ends the file.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "experiments/batch/comparison.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/system/output_path.h"

namespace turbidock::gate {

inline constexpr int kBaselineSchema = 3;
// A baseline is replaced by one, also if it is damaged or of another schema.
inline constexpr system::FileKind kBaselineFile = {
    "baseline of a gate", "# A gate's baseline, written by `turbidock gate"};

struct BaselineCondition {
  std::string name;
  std::string given;   // by the plan, for people
  std::string digest;  // what Condition::digest must be
  int trials = 0, successes = 0;
  double success_rate = 0;
  std::array<double, 2> interval_95{};           // Wilson
  std::vector<batch::ComparedTrial> outcomes{};  // in the order of the gate's seeds

  static void Fields(auto& self, auto&& field) {
    field("name", self.name, Finite(), "");
    field("given", self.given, Finite(), "");
    field("digest", self.digest, Finite(), "");
    field("trials", self.trials, AtLeast(1), "");
    field("successes", self.successes, AtLeast(0), "");
    field("success_rate", self.success_rate, InRange(0, 1), "");
    field("interval_95", self.interval_95, InRange(0, 1), "");
    field("outcomes", self.outcomes, Finite(), "");
  }
};

struct Baseline {
  int schema_version = kBaselineSchema;
  std::string build;  // BuildId of the program that measured it
  int64_t seed = 0;   // the plan's master seed
  std::vector<BaselineCondition> conditions;
  std::string checksum;

  static void Fields(auto& self, auto&& field) {
    field("schema_version", self.schema_version, InRange(kBaselineSchema, kBaselineSchema), "");
    field("build", self.build, Finite(), "");
    field("seed", self.seed, AtLeast(0), "");
    field("conditions", self.conditions, Finite(), "");
    field("checksum", self.checksum, Finite(), "");
  }
};

// The file's text, with its checksum.
std::string BaselineText(const Baseline& baseline);

// Reads a file. ConfigError when it is missing, from another schema, or its text is not as it was
// written.
Baseline LoadBaseline(const std::string& file);

// A baseline's conditions in the gate's order. ConfigError with the reason when it measured others.
std::vector<BaselineCondition> ConditionsOf(const Gate& gate, const Baseline& baseline);

}  // namespace turbidock::gate
