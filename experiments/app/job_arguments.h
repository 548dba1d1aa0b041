#pragma once
// The plan on a command line and what changes it; and who does a long command's jobs.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/command_line.h"
#include "experiments/batch/job_pool.h"
#include "experiments/batch/plan.h"

namespace turbidock::app {

struct PlanArguments {
  std::string plan;
  batch::PlanOverrides overrides;

  void AddTo(Subcommand* command, const trial::Plugins& plugins);
  batch::Plan Load() const { return batch::LoadPlan(plan, overrides); }
};

int AvailableCores();  // to this process

struct JobArguments {
  std::optional<int> workers;  // none: `alone` on this machine, one in a task of Slurm's
  std::optional<int> slurm;    // tasks
  std::vector<std::string> sbatch;
  int alone = 1;

  struct Options {
    Option workers, slurm;
  };
  // `alone`: how many processes without --workers.
  Options AddTo(Subcommand* command, const std::string& doc, int alone);

  // `out` is the file or folder that the command writes, beside which nodes find their work; empty
  // where there is none.
  batch::JobOptions For(const std::string& out,
                        const std::function<void(const std::string&)>& say) const;
};

}  // namespace turbidock::app
