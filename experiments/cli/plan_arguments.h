#pragma once
// The plan on a command line and what changes it.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "experiments/batch/plan.h"

namespace turbidock::experiments::cli {

struct PlanArguments {
  std::string plan;
  PlanOverrides overrides;

  void AddTo(CLI::App* command) {
    command
        ->add_option("plan", plan,
                     "YAML file or the name of a bundled plan (see `turbidock plans`)")
        ->required();
    command
        ->add_option("--set", overrides.assignments,
                     "Set one key of every trial, such as duration_s=30; may be repeated")
        ->type_name("KEY=VALUE")
        ->allow_extra_args(false);
    command->add_option("--seed", overrides.master_seed,
                        "Root of every trial's seed (master_seed)");
    command->add_option("--seeds", overrides.seeds, "Trials in each cell of the grid");
  }
  Plan Load() const { return LoadPlan(plan, overrides); }
};

// Cores that this process may use.
int AvailableCores();

}  // namespace turbidock::experiments::cli
