#include "experiments/farm/slurm.h"

#include <fmt/format.h>

#include <filesystem>

#include "experiments/farm/sbatch.h"
#include "sim/base/check.h"

namespace turbidock::farm {
namespace {

namespace fs = std::filesystem;

// What Slurm is told, first by us.
std::string DirectivesOf(const SlurmOptions& options, std::vector<std::string> own) {
  own.insert(own.end(), options.options.begin(), options.options.end());
  return Directives(own);
}

}  // namespace

SlurmFiles WriteSlurmScripts(const Plan& plan, const SlurmOptions& options) {
  const fs::path out = fs::absolute(options.out).lexically_normal();
  const fs::path folder = out.string() + ".slurm";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw ConfigError(folder.string() + ": cannot be made: " + error.message());
  const std::string program = QuotedProgram();
  const std::string quoted_folder = ShellQuoted(folder.string());

  WriteScriptFile(folder / "plan.yaml", plan.resolved(), /*executable=*/false);
  // A task that is preempted or reaches its time limit goes on where it stopped when it runs again.
  const std::string array =
      "#!/bin/bash\n" +
      DirectivesOf(options, {"--job-name=turbidock", fmt::format("--array=1-{}", options.tasks),
                             fmt::format("--cpus-per-task={}", options.workers), "--requeue",
                             "--open-mode=append",
                             fmt::format("--output=\"{}/task-%a.log\"", folder.string())}) +
      fmt::format(
          "cd {}\n"
          "exec {} batch plan.yaml --shard \"$SLURM_ARRAY_TASK_ID/{}\" --workers {} "
          "--out \"shard-$SLURM_ARRAY_TASK_ID.db\"\n",
          quoted_folder, program, options.tasks, options.workers);
  const std::string merge =
      "#!/bin/bash\n" +
      DirectivesOf(options,
                   {"--job-name=turbidock-merge", "--cpus-per-task=1", "--open-mode=append",
                    fmt::format("--output=\"{}/merge.log\"", folder.string())}) +
      fmt::format("cd {}\nexec {} merge --complete {} shard-*.db\n", quoted_folder, program,
                  ShellQuoted(out.string()));
  SlurmFiles files = {folder.string(), (folder / "array.sh").string(),
                      (folder / "merge.sh").string()};
  WriteScriptFile(files.array_script, array, /*executable=*/true);
  WriteScriptFile(files.merge_script, merge, /*executable=*/true);
  return files;
}

SlurmJobs SubmitSlurm(const SlurmFiles& files) {
  SlurmJobs jobs;
  jobs.array = Sbatch({files.array_script});
  jobs.merge = Sbatch({"--dependency=afterany:" + jobs.array, files.merge_script});
  return jobs;
}

}  // namespace turbidock::farm
