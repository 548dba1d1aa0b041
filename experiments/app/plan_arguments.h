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
  // With a bar where the plan's trials take long to look at.
  farm::Plan Load(bool quiet) const;
};

// Cores that this process may use.
int AvailableCores();

}  // namespace turbidock::app
