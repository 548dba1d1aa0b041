#pragma once
// The plan on a command line and what changes it.

#include <string>

#include "experiments/app/command_line.h"
#include "experiments/batch/plan.h"

namespace turbidock::app {

struct PlanArguments {
  std::string plan;
  batch::PlanOverrides overrides;

  void AddTo(Subcommand* command, const trial::Plugins& plugins);
  batch::Plan Load() const { return batch::LoadPlan(plan, overrides); }
};

// Cores that this process may use.
int AvailableCores();

}  // namespace turbidock::app
