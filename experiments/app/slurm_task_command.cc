#include "experiments/app/commands.h"
#include "experiments/batch/job_pool.h"
#include "experiments/batch/runner.h"
#include "experiments/studies/recognition/calibration.h"
#include "experiments/studies/recognition/recognition.h"

namespace turbidock::app {
namespace {

struct SlurmTaskArguments {
  std::string folder;
  int task = 0, workers = 1;
  trial::Plugins plugins;
};

int SlurmTask(const SlurmTaskArguments& arguments) {
  batch::RunSlurmTask(arguments.folder, arguments.task, arguments.workers,
                      {batch::TrialWork(arguments.plugins),
                       recognition::CellWork(arguments.plugins), recognition::EvaluationWork()});
  return kExitDone;
}

}  // namespace

void AddSlurmTask(CommandLine& line) {
  auto [task, arguments] =
      line.Add("slurm-task", "What a task of --slurm runs; not for people", &SlurmTask);
  task.Hidden();
  arguments.plugins = line.plugins();
  task.Add("folder", arguments.folder, "The array's folder").Required();
  task.Add("--task", arguments.task, "Its number in the array").Required().NotNegative();
  task.AddWorkers(arguments.workers, "Processes");
}

}  // namespace turbidock::app
