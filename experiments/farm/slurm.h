#pragma once
// A batch as a Slurm job array: a task a shard, and a job that merges them.

#include <string>
#include <vector>

#include "experiments/farm/plan.h"

namespace turbidock::farm {

struct SlurmOptions {
  int tasks = 1;                     // shards
  int workers = 1;                   // processes of a task, and the cores it asks for
  std::string out;                   // the merged file
  std::vector<std::string> options;  // further options of sbatch: "--time=2:00:00"
};

// Where a job array's files are; all paths are absolute.
struct SlurmFiles {
  std::string folder;  // OUT.slurm: plan.yaml, shard-I.db, task-I.log, merge.log and the scripts
  std::string array_script, merge_script;
};

// Writes the folder. The tasks run this executable on the resolved plan, so that neither the plan
// nor a scenario can change between them. ConfigError when it cannot be written.
SlurmFiles WriteSlurmScripts(const Plan& plan, const SlurmOptions& options);

// The numbers of the jobs: the array and the merge job, which waits for it, however it ends.
struct SlurmJobs {
  std::string array, merge;
};

// Submits both with sbatch. SimulatorFault when that is missing or refuses.
SlurmJobs SubmitSlurm(const SlurmFiles& files);

}  // namespace turbidock::farm
