#pragma once
// Plans from their text, and what is said of bad ones.

#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "tests/support/message_of.h"

namespace turbidock::batch {

inline const std::string kHead = "schema_version: 1\n";

inline Plan Make(const std::string& text, const PlanOverrides& overrides = {}) {
  return Plan(kHead + text, "plan.yaml", overrides);
}

// What is said of a plan that is no good, of trials in a pool.
inline std::string ErrorOf(const std::string& text, const PlanOverrides& overrides = {}) {
  return testing::MessageOf([&] { Make("scenario: pool_active\n" + text, overrides); });
}

inline std::vector<double> Draws(const Plan& plan, size_t parameter, int64_t first, int64_t count) {
  std::vector<double> draws;
  for (int64_t trial = first; trial < first + count; ++trial)
    draws.push_back(std::stod(plan.Trial(trial).parameters[parameter].value));
  return draws;
}

}  // namespace turbidock::batch
