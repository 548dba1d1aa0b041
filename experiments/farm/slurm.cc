#include "experiments/farm/slurm.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "experiments/system/subprocess.h"
#include "sim/base/check.h"

namespace turbidock::farm {
namespace {

namespace fs = std::filesystem;

// A word of the shell that means exactly this text.
std::string ShellQuoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

void WriteFile(const fs::path& path, const std::string& text, bool executable) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw ConfigError(path.string() + ": cannot be written: " + std::strerror(errno));
  if (executable) fs::permissions(path, fs::perms::owner_exec, fs::perm_options::add);
}

std::string Directives(const SlurmOptions& options, const std::vector<std::string>& own) {
  std::string text;
  for (const auto* list : {&own, &options.options})
    for (const std::string& option : *list) text += "#SBATCH " + option + "\n";
  return text;
}

// sbatch --parsable prints "JOB" or "JOB;CLUSTER".
std::string Submit(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {"sbatch", "--parsable"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  const std::string printed = system::Subprocess(command, "slurm-client").Finish();
  return printed.substr(0, printed.find_first_of(";\n"));
}

}  // namespace

SlurmFiles WriteSlurmScripts(const Plan& plan, const SlurmOptions& options) {
  const fs::path out = fs::absolute(options.out).lexically_normal();
  const fs::path folder = out.string() + ".slurm";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw ConfigError(folder.string() + ": cannot be made: " + error.message());
  const std::string program = ShellQuoted(fs::read_symlink("/proc/self/exe").string());
  const std::string quoted_folder = ShellQuoted(folder.string());

  WriteFile(folder / "plan.yaml", plan.resolved(), /*executable=*/false);
  // A task that is preempted or reaches its time limit goes on where it stopped when it runs again.
  const std::string array =
      "#!/bin/bash\n" +
      Directives(options, {"--job-name=turbidock", fmt::format("--array=1-{}", options.tasks),
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
      Directives(options, {"--job-name=turbidock-merge", "--cpus-per-task=1", "--open-mode=append",
                           fmt::format("--output=\"{}/merge.log\"", folder.string())}) +
      fmt::format("cd {}\nexec {} merge --complete {} shard-*.db\n", quoted_folder, program,
                  ShellQuoted(out.string()));
  SlurmFiles files = {folder.string(), (folder / "array.sh").string(),
                      (folder / "merge.sh").string()};
  WriteFile(files.array_script, array, /*executable=*/true);
  WriteFile(files.merge_script, merge, /*executable=*/true);
  return files;
}

SlurmJobs SubmitSlurm(const SlurmFiles& files) {
  SlurmJobs jobs;
  jobs.array = Submit({files.array_script});
  jobs.merge = Submit({"--dependency=afterany:" + jobs.array, files.merge_script});
  return jobs;
}

}  // namespace turbidock::farm
