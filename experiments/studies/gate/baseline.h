#pragma once
// The baseline of a gate: how every condition fared, a line a trial, in a YAML file to be
// committed. It is made by a gate run with --update and never by hand: a checksum over the text
// ends the file.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "experiments/studies/gate/gate_plan.h"
#include "experiments/system/output_path.h"

namespace turbidock::gate {

inline constexpr int kBaselineSchema = 2;
// A baseline is replaced by one, also if it is damaged or of another schema.
inline constexpr system::FileKind kBaselineFile = {
    "baseline of a gate", "# A gate's baseline, written by `turbidock gate"};

// What the gate needs of a trial.
struct GateTrial {
  int64_t seed = 0;
  trial::Outcome outcome = trial::Outcome::kTimeout;
  // Of kMedianMeasures; older baselines lack the last.
  MedianValues values{0, 0, 0, 0, 0, kNotMeasured};
  std::string digest;

  bool docked() const { return outcome == trial::Outcome::kDocked; }

  static void Fields(auto& self, auto&& field) {
    field("seed", self.seed, AtLeast(0), "");
    field("outcome", self.outcome, Finite(), "");
    for (size_t i = 0; i < kMedianMeasures.size(); ++i)
      field(kMedianMeasures[i].key, self.values[i], Finite(), "");
    field("digest", self.digest, Finite(), "");
  }
};

struct BaselineCondition {
  std::string name;
  std::string scenario;
  std::string settings;  // the condition's own, for people
  std::string digest;    // of scenario file and settings: what GateCondition::digest must be
  int trials = 0, docked = 0;
  double success_rate = 0;
  std::array<double, 2> interval_95{};  // Wilson
  std::vector<GateTrial> outcomes{};    // in the order of the gate's seeds

  static void Fields(auto& self, auto&& field) {
    field("name", self.name, Finite(), "");
    field("scenario", self.scenario, Finite(), "");
    field("settings", self.settings, Finite(), "");
    field("digest", self.digest, Finite(), "");
    field("trials", self.trials, AtLeast(1), "");
    field("docked", self.docked, AtLeast(0), "");
    field("success_rate", self.success_rate, InRange(0, 1), "");
    field("interval_95", self.interval_95, InRange(0, 1), "");
    field("outcomes", self.outcomes, Finite(), "");
  }
};

struct Baseline {
  int schema_version = kBaselineSchema;
  std::string build;  // BuildId of the program that measured it
  int64_t seed = 0;   // the gate's
  std::vector<BaselineCondition> conditions;
  std::string checksum;

  static void Fields(auto& self, auto&& field) {
    field("schema_version", self.schema_version, InRange(kBaselineSchema, kBaselineSchema), "");
    field("build", self.build, Finite(), "");
    field("seed", self.seed, AtLeast(0), "");
    field("conditions", self.conditions, Finite(), "");
    field("checksum", self.checksum, Finite(), "");
  }

  const BaselineCondition* Find(const std::string& name) const;  // null when there is none
};

// The file's text, with its checksum.
std::string BaselineText(const Baseline& baseline);

// Reads a file. ConfigError when it is missing, from another schema, or its text is not as it was
// written.
Baseline LoadBaseline(const std::string& file);

// Throws ConfigError with the reason when the baseline measured other conditions than the gate's.
void RequireSamePlan(const GatePlan& plan, const Baseline& baseline, const std::string& file);

}  // namespace turbidock::gate
