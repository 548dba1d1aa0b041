#include "experiments/command/job_arguments.h"

#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

namespace turbidock::command {
namespace {

// That this process may use.
int AvailableCores() {
  cpu_set_t cores;
  return sched_getaffinity(0, sizeof cores, &cores) == 0 ? CPU_COUNT(&cores) : 1;
}

}  // namespace

void PlanArguments::AddTo(Subcommand* command, const trial::Plugins& plugins) {
  overrides.plugins = plugins;
  command->Add("plan", plan, "YAML file or the name of a bundled plan (see `turbidock list plans`)")
      .Required();
  command->AddSet(assignments, "Set one key of every trial, such as trial.duration_s=30");
  command->AddGains(gains);
  command->Add("--seed", overrides.master_seed, "Root of every trial's seed (master_seed)")
      .NotNegative();
  command
      ->Add("--seeds", overrides.seeds,
            "Exactly so many trials in each cell of the grid, whatever precision the plan asks")
      .Between(1, 1000000);
}

batch::Plan PlanArguments::Load() const {
  batch::PlanOverrides all = overrides;
  all.assignments = trial::GivenBy(gains, assignments);
  return batch::LoadPlan(plan, all);
}

void JobArguments::AddTo(Subcommand* command, const std::string& doc) {
  const int cores = AvailableCores();
  command->Add("--workers", workers, fmt::format("{} [{}]; of a Slurm task [1]", doc, cores))
      .Between(1, 1024);
  const char* group = "On a Slurm cluster";
  const Option tasks =
      command
          ->Add("--slurm TASKS", slurm,
                "Run as job arrays of at most so many tasks at a time, with --workers cores each")
          .Between(1, 100000)
          .Group(group);
  const auto problem = [](const std::string& value) {  // each is a line of a script
    const bool is_line = value.starts_with('-') && value.find_first_of("\r\n") == std::string::npos;
    return is_line ? "" : fmt::format("'{}' must be one line that begins with -", value);
  };
  command
      ->Add("--sbatch OPTION", sbatch,
            "A further option of sbatch, such as --sbatch=--time=2:00:00; may be repeated")
      .Check(problem)
      .Group(group)
      .Needs(tasks);
}

batch::JobOptions JobArguments::For(const std::string& out,
                                    const std::function<void(const std::string&)>& say) const {
  if (!slurm) return {.workers = workers.value_or(AvailableCores()), .slurm = {}};
  const std::string folder =
      out.empty() ? fmt::format("turbidock-{}.slurm", getpid()) : out + ".slurm";
  return {.workers = workers.value_or(1),
          .slurm =
              batch::SlurmParams{.tasks = *slurm, .options = sbatch, .folder = folder, .say = say}};
}

}  // namespace turbidock::command
