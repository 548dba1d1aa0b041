#pragma once
// The plan on a command line and what changes it.

#include <string>

#include "experiments/app/command_line.h"
#include "experiments/farm/plan.h"

namespace turbidock::app {

struct PlanArguments {
  std::string plan;
  farm::PlanOverrides overrides;

  void AddTo(Subcommand* command, const trial::Plugins& plugins);
  farm::Plan Load() const { return farm::LoadPlan(plan, overrides); }
};

// Cores that this process may use.
int AvailableCores();

}  // namespace turbidock::app
