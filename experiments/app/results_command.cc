#include <fmt/format.h>

#include <string>
#include <vector>

#include "experiments/batch/batch.h"
#include "experiments/batch/result_store.h"
#include "experiments/command/command_line.h"
#include "experiments/command/progress.h"
#include "experiments/studies/run/shown_trial.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"

namespace turbidock::app {
namespace {

struct MergeArguments {
  std::string out;
  std::vector<std::string> inputs;
  bool complete = false;
};

int Merge(const MergeArguments& arguments) {
  system::OutputPlan outputs;
  outputs.Reads(arguments.inputs).Writes(arguments.out, system::kResultFile).Require();
  const std::string& first = arguments.inputs.front();
  batch::StoreHeader header = batch::ResultStore::Read(first).header();
  header.shard = {};
  for (const std::string& input : arguments.inputs) {
    const std::string difference = batch::DifferenceOf(
        header, batch::ResultStore::Read(input).header(), {"in " + first, "in " + input});
    if (!difference.empty())
      throw batch::MismatchError(
          fmt::format("{} does not go with {}: {}", input, first, difference));
  }
  batch::ResultStore store = batch::ResultStore::Write(arguments.out, header);
  for (const std::string& input : arguments.inputs) store.Merge(input);
  const batch::TrialScheduler scheduler = batch::SchedulerOf(store);
  fmt::print("{}: {} of {} trials\n", system::OneLineOf(arguments.out), std::ssize(store.Done()),
             scheduler.wanted());
  return arguments.complete && !scheduler.complete() ? command::kExitCheckFailed
                                                     : command::kExitDone;
}

struct ReplayArguments {
  trial::Plugins plugins;
  std::string file;
  int64_t trial = 0;
  std::string out;
  bool no_video = false, json = false, quiet = false;
};

int Replay(const ReplayArguments& arguments) {
  const batch::ResultStore store = batch::ResultStore::Read(arguments.file);
  const batch::StoreHeader& header = store.header();
  if (!header.is_of_plan())
    throw ConfigError(arguments.file + ": was written by " + header.kind +
                      ", not by batch or gate");
  const batch::Plan plan(store.PlanHere(), arguments.file + "'s plan",
                         {.plugins = arguments.plugins});
  const trial::TrialRecord before = store.Trial(arguments.trial).record;
  if (header.build != system::BuildId())
    command::Progress(arguments.quiet)
        .Say("the results are of " + header.build + ", this is " + system::BuildId());
  const std::string out =
      arguments.out.empty() ? fmt::format("out/replay-{}", arguments.trial) : arguments.out;
  const trial::Scenario scenario = plan.ScenarioOf(plan.Trial(arguments.trial));
  const trial::TrialResult result = run::RunShownTrial(scenario, {.inputs = {arguments.file},
                                                                  .out = out,
                                                                  .video = !arguments.no_video,
                                                                  .json = arguments.json,
                                                                  .quiet = arguments.quiet});
  if (command::StopSignal() != 0) return command::kExitDone;
  if (result.digest == before.digest) {
    command::Progress(arguments.quiet).Say("the same digest as stored");
    return command::kExitDone;
  }
  if (!trial::HasEnd(before.outcome)) {  // a time limit, say, is another one every time
    command::Progress(arguments.quiet)
        .Print(fmt::format("trial {} ended {}, now {}", arguments.trial, NameOf(before.outcome),
                           NameOf(result.outcome)));
    return command::kExitDone;
  }
  throw batch::MismatchError(fmt::format("trial {} ended {} with digest {}, now {} with digest {}",
                                         arguments.trial, NameOf(before.outcome), before.digest,
                                         NameOf(result.outcome), result.digest));
}

}  // namespace

void AddResults(command::CommandLine& line) {
  auto [merge, merge_arguments] =
      line.Add("merge", "Put the shards of a batch into one file", &Merge);
  merge.Add("out", merge_arguments.out, "The file to make or to add to").Required();
  merge.Add("inputs", merge_arguments.inputs, "Files that batch wrote").Required();
  merge.Flag("--complete", merge_arguments.complete, "Exit with 1 when trials are missing");

  auto [replay, replay_arguments] =
      line.Add("replay", "Run one trial of a batch again, with video and all its files", &Replay);
  replay_arguments.plugins = line.plugins();
  replay.Add("results", replay_arguments.file, "A batch's file").Required();
  replay.Add("trial", replay_arguments.trial, "The trial's number").Required();
  replay.Add("--out", replay_arguments.out, "Folder for its files; out/replay-TRIAL");
  replay.Flag("--no-video", replay_arguments.no_video, "Make no video.mp4");
  replay.AddJson(replay_arguments.json);
  replay.AddQuiet(replay_arguments.quiet);
}

}  // namespace turbidock::app
