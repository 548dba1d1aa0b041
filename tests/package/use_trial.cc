// A whole trial from C++.

#include <cstdio>

#include "experiments/trial.h"

int main() {
  using namespace turbidock::experiments;
  const TrialResult result = RunTrial(LoadScenario("pool_active", {"duration_s=0.5"}));
  std::printf("%s\n", result.reason.c_str());
  return result.outcome == Outcome::kTimeout && result.log.frames.size() == 15 ? 0 : 1;
}
