#include <fmt/format.h>

#include <cstdio>

#include "experiments/app/commands.h"
#include "experiments/app/plan_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/farm/slurm.h"
#include "experiments/report/json.h"
#include "experiments/system/output_path.h"

namespace turbidock::app {
namespace {

struct SlurmArguments {
  PlanArguments plan;
  farm::SlurmOptions options;
  bool submit = false, json = false;
};

int Slurm(const SlurmArguments& arguments) {
  const farm::Plan plan = arguments.plan.Load(/*quiet=*/false);
  system::OutputPlan()
      .Reads(arguments.plan.plan)
      .Writes(arguments.options.out, system::kResultFile)
      .Require();
  const farm::SlurmFiles files = farm::WriteSlurmScripts(plan, arguments.options);
  Progress progress(/*quiet=*/false);
  progress.Say(fmt::format("{}: {}{} trials in {} tasks, scripts in {}",
                           plan.settings().description, plan.settings().precision ? "up to " : "",
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
  auto [slurm, arguments] = line.Add(
      "slurm", "Write a plan as a Slurm job array and a job that merges its results", &Slurm);
  arguments.plan.AddTo(&slurm, line.plugins());
  farm::SlurmOptions& options = arguments.options;
  slurm.Add("--tasks", options.tasks, "Tasks of the array, each a shard")
      .Required()
      .Between(1, 100000);
  slurm.Add("--out FILE", options.out, "SQLite file for the merged results").Required();
  slurm.AddWorkers(options.workers, "Processes and cores of a task");
  slurm.AddSbatch(options.options);
  slurm.Flag("--submit", arguments.submit, "Also submit both jobs");
  slurm.Flag("--json", arguments.json, "Print files and jobs as JSON on stdout");
}

}  // namespace turbidock::app
