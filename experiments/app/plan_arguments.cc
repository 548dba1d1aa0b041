#include "experiments/app/plan_arguments.h"

#include <sched.h>

namespace turbidock::app {

void PlanArguments::AddTo(Subcommand* command, const trial::Plugins& plugins) {
  overrides.plugins = plugins;
  command->Add("plan", plan, "YAML file or the name of a bundled plan (see `turbidock list plans`)")
      .Required();
  command->AddSet(overrides.assignments, "Set one key of every trial, such as duration_s=30");
  command->Add("--seed", overrides.master_seed, "Root of every trial's seed (master_seed)");
  command->Add("--seeds", overrides.seeds,
               "Exactly so many trials in each cell of the grid, whatever precision the plan asks");
}

int AvailableCores() {
  cpu_set_t cores;
  return sched_getaffinity(0, sizeof cores, &cores) == 0 ? CPU_COUNT(&cores) : 1;
}

}  // namespace turbidock::app
