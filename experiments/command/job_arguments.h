#pragma once
// The plan on a command line and what changes it; and who does a long command's jobs.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/job_pool.h"
#include "experiments/batch/plan.h"
#include "experiments/command/command_line.h"

namespace turbidock::command {

struct PlanArguments {
  std::string plan, gains;
  std::vector<std::string> assignments = {};
  batch::PlanOverrides overrides = {};

  void AddTo(Subcommand* command, const trial::Plugins& plugins);
  batch::Plan Load() const;
};

struct JobArguments {
  std::optional<int> workers;  // none: all cores of this machine, one in a task of Slurm's
  std::optional<int> slurm;    // tasks
  std::vector<std::string> sbatch;

  void AddTo(Subcommand* command, const std::string& doc);

  // `out` is the file or folder that the command writes, beside which nodes find their work; empty
  // where there is none.
  batch::JobOptions For(const std::string& out,
                        const std::function<void(const std::string&)>& say) const;
};

}  // namespace turbidock::command
