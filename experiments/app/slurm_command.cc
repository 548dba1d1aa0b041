#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "experiments/app/commands.h"
#include "experiments/app/plan_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/farm/slurm.h"
#include "experiments/report/json.h"

namespace turbidock::app {
namespace {

struct SlurmArguments {
  PlanArguments plan;
  farm::SlurmOptions options;
  bool submit = false, json = false;
};

int Slurm(const SlurmArguments& arguments) {
  const farm::Plan plan = arguments.plan.Load();
  const farm::SlurmFiles files = farm::WriteSlurmScripts(plan, arguments.options);
  Progress progress(/*quiet=*/false);
  progress.Say(fmt::format("{}: {} trials in {} tasks, scripts in {}", plan.settings().description,
                           plan.trials(), arguments.options.tasks, files.folder));
  report::Json json = {{"folder", files.folder},
                       {"array_script", files.array_script},
                       {"merge_script", files.merge_script}};
  if (arguments.submit) {
    const farm::SlurmJobs jobs = farm::SubmitSlurm(files);
    progress.Say(fmt::format("submitted as job {}; job {} then merges it into {}", jobs.array,
                             jobs.merge, arguments.options.out));
    json["array_job"] = jobs.array;
    json["merge_job"] = jobs.merge;
  }
  if (arguments.json) fmt::print("{}", report::JsonText(json));
  return kExitDone;
}

}  // namespace

void AddSlurm(CommandLine& line) {
  auto arguments = std::make_shared<SlurmArguments>();
  Subcommand slurm =
      line.Add("slurm", "Write a plan as a Slurm job array and a job that merges its results");
  arguments->plan.AddTo(&slurm);
  slurm.Add("--tasks", arguments->options.tasks, "Tasks of the array, each a shard")
      .Required()
      .Between(1, 100000);
  slurm.Add("--out", arguments->options.out, "SQLite file for the merged results")
      .Required()
      .Type("FILE");
  slurm.Add("--workers", arguments->options.workers, "Processes and cores of a task")
      .Between(1, 1024)
      .ShowsDefault();
  slurm
      .Add("--sbatch", arguments->options.options,
           "A further option of sbatch, such as --sbatch=--time=2:00:00; may be repeated")
      .Type("OPTION")
      .OneValueEach();
  slurm.Flag("--submit", arguments->submit, "Also submit both jobs");
  slurm.Flag("--json", arguments->json, "Print files and jobs as JSON on stdout");
  slurm.Runs([arguments] { return Slurm(*arguments); });
}

}  // namespace turbidock::app
