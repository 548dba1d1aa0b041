// A whole trial from C++.

#include <cstdio>

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

int main() {
  using namespace turbidock;
  const trial::TrialResult result =
      trial::RunTrial(trial::LoadScenario("pool_active", {"trial.duration_s=0.5"}));
  std::printf("%s\n", result.reason.c_str());
  return result.outcome == trial::Outcome::kTimeout && result.log.frames.size() == 15 ? 0 : 1;
}
