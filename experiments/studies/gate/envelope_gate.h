#pragma once
// What a gate says of an envelope: the share of the ranges that today's build has lost.
//
// The trials that the baseline's search chose, near the boundary, run again with the same seeds, so
// success is judged pair by pair as in any other condition. What a loss of area means for these
// trials, and a loss among them for the area, says a shift: the log odds of success lowered by the
// same amount everywhere, in every draw of the baseline's boundary (search::Boundary).

#include <vector>

#include "experiments/batch/comparison.h"
#include "experiments/batch/envelope.h"
#include "experiments/studies/gate/baseline.h"
#include "experiments/studies/gate/gate_plan.h"

namespace turbidock::gate {

class EnvelopeShift {
 public:
  EnvelopeShift(const batch::Plan& plan, const BaselineCondition& baseline);

  // Share of the ranges in which the baseline succeeds more often than the rate looked for.
  double area() const { return AreaAfter(0); }
  // Losses that go together; gains are negative. Of success: share of the baseline's trials.
  double SuccessLost(double area_lost) const;
  double AreaLost(double success_lost) const;

 private:
  double AreaAfter(double shift) const;
  double SuccessAfter(double shift) const;

  double log_odds_;                     // of the rate looked for
  std::vector<search::Tally> tallies_;  // by place
  int64_t count_;                       // trials of all places
  search::Boundary boundary_;
};

// The area as a change beside that of success, which carries the verdict.
batch::Change AreaChange(const EnvelopeShift& shift, const batch::Change& success);

// Both sides' boundaries, each by its own trials.
batch::EnvelopeSummary BoundariesOf(const batch::Plan& plan,
                                    const std::vector<batch::StoredTrial>& before,
                                    const std::vector<batch::StoredTrial>& now);

// The trials of a baseline as far as a boundary needs them.
std::vector<batch::StoredTrial> TrialsIn(const BaselineCondition& baseline,
                                         const batch::Plan& plan);

}  // namespace turbidock::gate
