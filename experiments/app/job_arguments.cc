#include "experiments/app/job_arguments.h"

#include <fmt/format.h>
#include <unistd.h>

namespace turbidock::app {

JobArguments::Options JobArguments::AddTo(Subcommand* command, const std::string& doc,
                                          int alone_now) {
  alone = alone_now;
  const Option processes =
      command->Add("--workers", workers, fmt::format("{} [{}]; of a Slurm task [1]", doc, alone))
          .Between(1, 1024);
  const char* group = "On a Slurm cluster";
  const Option tasks =
      command
          ->Add("--slurm TASKS", slurm,
                "Run as job arrays of at most so many tasks at a time, with --workers cores each")
          .Between(1, 100000)
          .Group(group);
  command->AddSbatch(sbatch).Group(group).Needs(tasks);
  return {processes, tasks};
}

batch::JobOptions JobArguments::For(const std::string& out,
                                    const std::function<void(const std::string&)>& say) const {
  if (!slurm) return {.workers = workers.value_or(alone), .slurm = {}};
  const std::string folder =
      out.empty() ? fmt::format("turbidock-{}.slurm", getpid()) : out + ".slurm";
  return {.workers = workers.value_or(1),
          .slurm =
              batch::SlurmParams{.tasks = *slurm, .options = sbatch, .folder = folder, .say = say}};
}

}  // namespace turbidock::app
