#include <fmt/format.h>

#include <string>

#include "experiments/command/command_line.h"
#include "experiments/command/job_arguments.h"
#include "experiments/command/progress.h"
#include "experiments/studies/dataset/dataset.h"

namespace turbidock::dataset {
namespace {

struct DatasetArguments {
  command::PlanArguments plan;
  command::JobArguments jobs;
  std::string out;
  DatasetOptions options;
  bool quiet = false;
};

int Make(const DatasetArguments& arguments) {
  DatasetOptions options = arguments.options;
  const batch::Plan plan = arguments.plan.Load();
  command::Progress progress(arguments.quiet);
  progress.Say(fmt::format("{}: {} images", plan.title(), 2 * plan.trials()));
  for (const std::string& remark : plan.remarks()) progress.Say("  " + remark);
  options.jobs = arguments.jobs.For(arguments.out,
                                    [&](const std::string& text) { progress.Say("  " + text); });
  options.on_progress = [&](int done, int of) { progress.ShowDone(done, of, "shards", 30); };
  options.stop_requested = command::CatchStopSignals();
  const DatasetSummary made = MakeDataset(plan, arguments.out, options);
  if (made.shards_before > 0)
    progress.Say(fmt::format("  {} of {} shards were there", made.shards_before, made.shards));
  progress.Say(
      made.complete
          ? fmt::format("{} images in {} shards in {}", made.images, made.shards, arguments.out)
          : fmt::format("stopped; the same command goes on in {}", arguments.out));
  return command::kExitDone;
}

}  // namespace

void AddDataset(command::CommandLine& line) {
  auto [dataset, arguments] = line.Add<DatasetArguments>(
      "dataset", "Make images with ground truth from a plan's trials, for training detectors",
      &Make);
  arguments.plan.AddTo(&dataset, line.plugins());
  arguments.plan.overrides.refused = RefusedKeys();
  arguments.plan.overrides.sees_images = true;
  dataset
      .Add("--out FOLDER", arguments.out,
           "Where: BOP layout with COCO keypoints beside it; shards that are there are kept")
      .Required();
  dataset.Add("--pairs-per-shard", arguments.options.pairs_per_shard, "Pairs of images in a folder")
      .Between(1, 100000);
  dataset.Flag("--depth", arguments.options.depth, "Depth images, too");
  arguments.jobs.AddTo(&dataset, "Processes, a shard each");
  dataset.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::dataset
