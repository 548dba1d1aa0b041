#pragma once
// A gate's file and builds that are made up: how a trial ends follows from its seed alone.

#include "experiments/studies/gate/gate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/report/report_json.h"
#include "sim/base/digest.h"
#include "sim/base/random.h"
#include "tests/support/own_folder.h"

namespace turbidock::gate {

// How a build docks: from the seed alone, as a trial does.
using Build = std::function<trial::TrialRecord(int64_t condition, int64_t seed)>;

inline Rng Noise(int64_t seed, const std::string& what) {
  return SeedTree(static_cast<uint64_t>(seed)).Stream(what);
}

inline trial::TrialRecord Ended(int64_t seed, trial::Outcome outcome, double time_s = 20) {
  trial::TrialRecord record;
  record.seed = seed;
  record.outcome = outcome;
  record.failure =
      outcome == trial::Outcome::kSuccess ? trial::Failure::kNone : trial::Failure::kTimeout;
  record.time_s = time_s;
  record.digest = DigestOf(fmt::format("{} {}", NameOf(outcome), time_s));
  return record;
}
inline trial::TrialRecord Ended(int64_t seed, bool succeeds, double time_s = 20) {
  return Ended(seed, succeeds ? trial::Outcome::kSuccess : trial::Outcome::kTimeout, time_s);
}

// Docks at a rate, after about 40 s; `more` makes each of its trials so much worse.
inline Build DocksAt(double rate, const std::function<void(trial::TrialRecord*)>& more = {}) {
  return [=](int64_t, int64_t seed) {
    trial::TrialRecord record =
        Ended(seed, Noise(seed, "docks").Uniform() < rate, 40 + 4 * Noise(seed, "time").Normal());
    record.final_error_true.y_m = 0.01 + 0.005 * Noise(seed, "error").Uniform();
    record.returns_to_servoing = static_cast<int>(3 * Noise(seed, "returns").Uniform());
    record.fitness_mean = 0.6 + 0.05 * Noise(seed, "fitness").Normal();
    record.effort_v = 1 + 0.1 * Noise(seed, "effort").Uniform();
    record.tracking_rms_m = 0.02 + 0.01 * Noise(seed, "tracking").Uniform();
    record.false_confidence_s = 0.2 * Noise(seed, "claims").Uniform();
    if (more) more(&record);
    return record;
  };
}
inline Build Slower(double rate, double by_s) {
  return DocksAt(rate, [by_s](trial::TrialRecord* record) { record->time_s += by_s; });
}

// Gives results as a build would; of those under way the last one that was asked for comes first.
inline int Drive(const Gate& gate, const Build& build, GateRun* run, size_t at_once = 3) {
  std::vector<int64_t> under_way;
  for (int trials = 0;; ++trials) {
    while (under_way.size() < at_once) {
      const auto trial = run->Next();
      if (!trial) break;
      under_way.push_back(*trial);
    }
    if (under_way.empty()) return trials;
    const batch::TrialSpec spec = gate.plan.Trial(under_way.back());
    under_way.pop_back();
    run->Add({.trial = spec.trial,
              .cell = spec.cell,
              .sample = spec.sample,
              .parameters = spec.parameters,
              .record = build(spec.cell, spec.seed)});
  }
}

inline Baseline Measure(const Gate& gate, const Build& build) {
  GateRun run(gate);
  Drive(gate, build, &run, 7);
  return run.Measured();
}

inline GateReport Judge(const Gate& gate, const Baseline& baseline, const Build& build,
                        size_t at_once = 3, int* trials = nullptr) {
  GateRun run(gate, baseline);
  const int ran = Drive(gate, build, &run, at_once);
  if (trials) *trials = ran;
  return run.Report();
}

inline std::string JsonOf(const GateReport& report) {
  return report::JsonText(report::Document(ReportOf(report), report));
}

inline const report::Section& SectionOf(const report::Report& report, const std::string& title) {
  for (const report::Section& section : report.sections)
    if (section.title == title) return section;
  throw std::runtime_error("no section " + title);
}

class SyntheticGate : public testing::OwnFolder {
 protected:
  // With these cases beside `calm` and these keys of the group.
  Gate Load(const std::string& cases = "", const std::string& keys = "",
            const std::vector<std::string>& given = {}) {
    return LoadGate(
        File("gate.yaml",
             "schema_version: 1\ndescription: docking\nscenario: pool_active\n"
             "seeds: 200\ncases:\n"
             "  calm: {water.milk_ml_m3: 20, sea: {state: calm}}\n" +
                 cases + "gate:\n  baseline: gate.baseline.yaml\n" +
                 "  margins: {success_rate: 0.1, time_s: 5, final_error_m: 0.01}\n" + keys),
        {}, config::ParseAssignments(given));
  }
  static constexpr const char* kRough = "  rough: {scenario: sea_night_active}\n";
};

}  // namespace turbidock::gate
