#pragma once
// Which conditions a gate should watch, with what margins and how many trials, to notice a loss.
//
// A regression makes docking harder everywhere. How hard a condition is, is z = Phi^-1(rate) of its
// success rate (a probit model); a loss takes the same from every z, as much as takes the rate
// `from` to the rate `to`. Where all dock it shows in next to none, however large, and where few
// dock there is little to lose: what shows it best are conditions at the edge, and how many trials
// of them a budget pays for.

#include <string>
#include <vector>

#include "experiments/farm/plan.h"
#include "experiments/report/report.h"
#include "experiments/studies/gate/judge.h"
#include "sim/base/result_fields.h"

namespace turbidock::gate {

// A condition that was tried: a cell of a plan.
struct Candidate {
  std::string name;
  std::string scenario;                   // a bundled one or a file
  std::vector<farm::Parameter> settings;  // over it
  int trials = 0, docked = 0;
  double trial_s = 0;                // processor time of a trial, median
  std::vector<Quality> docked_well;  // of the trials that docked, in order

  // With half a trial more that docked and half a one that did not: never 0 or 1.
  double rate() const { return (docked + 0.5) / (trials + 1.0); }
};

// From the file of a batch of the plan. ConfigError when the results are another plan's or damaged,
// or its trials are drawn: a gate's conditions are fixed.
std::vector<Candidate> CandidatesOf(const farm::Plan& plan, const std::string& file);

struct DesignOptions {
  double from = 0.95, to = 0.85;    // the loss to notice, as above
  double alpha = 0.05, beta = 0.1;  // of the gate
  double budget_s = 240;            // of a build without change
  int workers = 2;                  // that share the processor time
  int most_trials = 400;            // of a condition

  TURBIDOCK_FIELDS(from, to, alpha, beta, budget_s, workers)
};

// A condition as a gate would watch it.
struct DesignedCondition {
  std::string name;
  double rate = 0, lost_rate = 0;  // as it is, and after the loss
  bool easy = false;               // for what breaks docking altogether
  GateMargins margins = {};        // of medians: with which a build whose trials only differ passes
  int max_trials = 0;
  int unchanged_trials = 0;  // after which a build without change passes
  double unchanged_s = 0;    // their processor time
  double power = 0;          // probability to fail after the loss

  TURBIDOCK_FIELDS(name, rate, lost_rate, easy, margins, max_trials, unchanged_trials, unchanged_s,
                   power)
};

// At most so many conditions share alpha.
inline constexpr int kMostConditions = 4;

struct GateDesign {
  DesignOptions options;
  std::vector<DesignedCondition> candidates;  // each by itself, in the plan's order
  std::vector<DesignedCondition> chosen;      // those at the edge first, at last an easy one
  double unchanged_s = 0;                     // wall time, by all workers
  double power = 0;                           // that at least one of them fails

  static void Fields(auto& self, auto&& field) {
    DesignOptions::Fields(self.options, field);
    self.VisitFields(field);
  }
  TURBIDOCK_VISIT_FIELDS(unchanged_s, power, candidates, chosen)
};

// Chooses one by one whatever adds most power within the budget, of different kinds (keys that are
// set) as far as there are any, of those alike the cheapest; and beside them the easiest condition,
// unless that is at the edge itself. ConfigError when no candidate is at the edge, or the budget
// does not pay for one.
GateDesign DesignGate(const std::vector<Candidate>& candidates, const DesignOptions& options);

// The gate's file. Scenario files are named as seen from `folder`.
std::string GateYaml(const GateDesign& design, const std::vector<Candidate>& candidates,
                     const std::string& baseline, const std::string& folder);

// Of kind "gate_design".
report::Report ReportOf(const GateDesign& design);

}  // namespace turbidock::gate
