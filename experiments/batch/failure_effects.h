#pragma once
// Which of what was varied, and of how trials began, goes with their failures.

#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/result_store.h"
#include "experiments/report/report.h"
#include "sim/base/result_fields.h"

namespace turbidock::batch {

struct FailureEffect {
  std::string name;                    // "start heading", "case: one thruster weak"
  std::string change;                  // "5 to 17°", "against the others"
  double odds = 1;                     // of failing are so many times higher after the change
  double odds_low = 0, odds_high = 0;  // 95 %
  double p = 1;
  bool significant = false;  // Holm at 5 % over all effects

  TURBIDOCK_FIELDS(name, change, odds, odds_low, odds_high, p, significant)
};

// Of each on its own, the least p first: parameters that are numbers, from their lower to their
// upper quartile, or where these are the same from the least value to the largest; of others each
// value against the rest; how far from the middle trials began (`start_...`). Firth's logistic
// regression, in which the trials of a seed count as a cluster (FitSlope). Nothing where fewer than
// 5 trials failed or fewer than 5 succeeded, of a value that fewer than 5 have or have not, and of
// what does not vary.
std::vector<FailureEffect> FailureEffects(const std::vector<StoredTrial>& trials);

// The foremost of them as a table; nothing without any.
std::optional<report::Section> FailureSection(const std::vector<FailureEffect>& effects);

}  // namespace turbidock::batch
