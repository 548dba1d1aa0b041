// How often the gate's test of a success rate errs, and after how many trials it decides:
// assets/measured/gate_error_rates.csv.
//
//   gate_error_rates SEQUENCES     such as: gate_error_rates 10000
//
// Made-up pairs of trials, old and new build on the same seed, 0.95 of the old build's docking:
// drawn independently, and as twins that differ only where the new build loses. Margin 0.1, both
// errors 0.05, 169 pairs at most. A row each: pairs, false alarms at 0.95, losses missed at 0.85,
// mean pairs until a verdict at 0.95 and at 0.85.

#include <fmt/format.h>

#include <cstdlib>
#include <optional>
#include <string>

#include "experiments/statistics/paired_measure.h"
#include "sim/base/random.h"

namespace {

using namespace turbidock;
using namespace turbidock::statistics;

constexpr double kOldRate = 0.95, kMargin = 0.1;
constexpr PairedDesign kDesign{.margin = kMargin, .alpha = 0.05, .beta = 0.05, .most = 169};

struct Counts {
  int failed = 0, passed = 0;
  long pairs = 0;
};

Counts CountsOf(int sequences, double new_rate, bool twins, Rng* rng) {
  Counts counts;
  for (int sequence = 0; sequence < sequences; ++sequence) {
    PairedMeasure measure(MeasureKind::kRate, -1, kDesign);
    std::optional<Verdict> verdict;
    for (int pair = 1; pair <= kDesign.most && !verdict; ++pair, ++counts.pairs) {
      const bool old_docks = rng->Uniform() < kOldRate;
      const bool new_docks =
          twins ? old_docks && rng->Uniform() < new_rate / kOldRate : rng->Uniform() < new_rate;
      measure.Add(old_docks, new_docks, pair, pair);
      verdict = measure.verdict();
    }
    counts.failed += verdict == Verdict::kFail;
    counts.passed += verdict == Verdict::kPass;
  }
  return counts;
}

}  // namespace

int main(int argc, char** argv) {
  const int sequences = argc == 2 ? std::atoi(argv[1]) : 0;
  if (sequences < 1) {
    fmt::print(stderr, "gate_error_rates SEQUENCES\n");
    return 2;
  }
  Rng rng = SeedTree(20261121).Stream("pairs");
  for (const bool twins : {true, false}) {
    const Counts same = CountsOf(sequences, kOldRate, twins, &rng);
    const Counts worse = CountsOf(sequences, kOldRate - kMargin, twins, &rng);
    const auto share = [&](auto count) { return static_cast<double>(count) / sequences; };
    fmt::print("{},{:.3f},{:.3f},{:.1f},{:.1f}\n", twins ? "twins" : "independent",
               share(same.failed), share(worse.passed), share(same.pairs), share(worse.pairs));
  }
}
