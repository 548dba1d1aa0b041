#include "experiments/trial/trial.h"

#include "experiments/trial/running_trial.h"

namespace turbidock::trial {

TrialResult RunTrial(const Scenario& scenario, const TrialOptions& options) {
  RunningTrial trial(scenario, options);
  while (!trial.ended()) trial.Step();
  return trial.Finish();
}

}  // namespace turbidock::trial
