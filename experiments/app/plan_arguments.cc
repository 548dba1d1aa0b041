#include "experiments/app/plan_arguments.h"

#include <sched.h>

#include "experiments/app/progress.h"

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

farm::Plan PlanArguments::Load(bool quiet) const {
  constexpr double kSayEvery_s = 10;
  Progress progress(quiet);
  farm::PlanOverrides with_bar = overrides;
  with_bar.on_look = [&progress](int64_t looked_at, int64_t of) {
    progress.ShowDone(static_cast<int>(looked_at), static_cast<int>(of), "trials looked at",
                      kSayEvery_s);
  };
  return farm::LoadPlan(plan, with_bar);
}

int AvailableCores() {
  cpu_set_t cores;
  return sched_getaffinity(0, sizeof cores, &cores) == 0 ? CPU_COUNT(&cores) : 1;
}

}  // namespace turbidock::app
