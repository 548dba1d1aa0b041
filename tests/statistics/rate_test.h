#pragma once
// The two tests of a rate by counts alone, as PairedMeasure takes them pair by pair.

#include <optional>

#include "experiments/statistics/sequential_test.h"

namespace turbidock::statistics {

struct RateTest {
  RateTest(double margin, double alpha, double beta, int max_pairs)
      : fail(alpha, max_pairs), pass(margin, beta) {}

  std::optional<Verdict> Decide(int pairs, int losses, int gains) const {
    if (fail.Rejects(losses + gains, losses)) return Verdict::kFail;
    if (pass.Rejects(pairs, losses, gains)) return Verdict::kPass;
    return std::nullopt;
  }

  SignTest fail;
  NetLossTest pass;
};

}  // namespace turbidock::statistics
