#pragma once
// How many trials a gate's test of the success rate takes and how often it errs, exactly.

#include <optional>
#include <vector>

#include "experiments/report/report.h"
#include "experiments/statistics/sequential_test.h"
#include "sim/base/result_fields.h"

namespace turbidock::gate {

// How the trials of two builds on the same seeds go together.
enum class Coupling {
  kIdentical,    // the new build does as the old one, but for what it loses
  kIndependent,  // the builds' outcomes have nothing to do with each other
};
constexpr auto Names(Coupling) {
  using enum Coupling;
  return EnumList<Coupling>({{kIdentical, "identical"}, {kIndependent, "independent"}});
}

struct SizeDesign {
  double no_worse = 0.95, worse = 0.85;  // success rates, 0 < worse < no_worse < 1
  double alpha = 0.05, beta = 0.05;      // of this test
};

// What the test says of a build, as probabilities, and after how many trials.
struct SizeRow {
  Coupling coupling = Coupling::kIdentical;
  double new_rate = 0;
  double fail = 0, pass = 0, inconclusive = 0;
  double expected_trials = 0;

  TURBIDOCK_FIELDS(coupling, new_rate, fail, pass, inconclusive, expected_trials)
};

struct GateSize {
  double no_worse = 0, worse = 0, alpha = 0, beta = 0;
  int max_trials = 0;
  std::vector<SizeRow> exact;

  TURBIDOCK_FIELDS(no_worse, worse, alpha, beta, max_trials, exact)
};

// The shares of pairs that docked in one of two builds only.
struct PairShares {
  double loss = 0, gain = 0;
};
PairShares SharesOf(Coupling coupling, double old_rate, double new_rate);

// So few trials at most that a build without change passes and one that loses `loss` of its pairs
// is left undecided with a probability of 1 % at most; `limit` where that takes more.
int TrialsToDecide(double margin, double alpha, double beta, double loss, int limit);

// ConfigError for what takes more trials than a gate may have.
GateSize SizeOf(const SizeDesign& design);

// Of kind "gate_plan_size".
report::Report ReportOf(const GateSize& size);

}  // namespace turbidock::gate
