#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/job_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/batch/batch.h"
#include "experiments/batch/result_store.h"
#include "experiments/batch/runner.h"
#include "experiments/studies/run/shown_trial.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"

namespace turbidock::app {
namespace {

// The plan that a file's trials follow.
batch::Plan PlanOf(const std::string& file, const batch::ResultStore& store,
                   const trial::Plugins& plugins) {
  if (store.header().kind != "batch")
    throw ConfigError(file + ": was written by " + store.header().kind + ", not by batch");
  return batch::Plan(store.header().plan, file, {.plugins = plugins});
}

void WarnOfOtherBuild(const batch::StoreHeader& header, Progress* progress) {
  if (header.build != system::BuildId())
    progress->Say("the results are of " + header.build + ", this is " + system::BuildId());
}

// ------------------------------------------------------------------------------------------- merge

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
    const auto differences = batch::Differences(header, batch::ResultStore::Read(input).header());
    if (!differences.empty())
      throw batch::MismatchError(fmt::format("{} and {}: {}", first, input, differences[0]));
  }
  batch::ResultStore store = batch::ResultStore::Write(arguments.out, header);
  for (const std::string& input : arguments.inputs) store.Merge(input);
  const batch::TrialScheduler scheduler = batch::SchedulerOf(store);
  fmt::print(stderr, "{}: {} of {} trials\n", system::OneLineOf(arguments.out),
             std::ssize(store.Done()), scheduler.wanted());
  return arguments.complete && !scheduler.complete() ? kExitCheckFailed : kExitDone;
}

// ------------------------------------------------------------------------------------------ verify

struct VerifyArguments {
  trial::Plugins plugins;
  std::string file;
  std::vector<int64_t> trials;
  int sample = 10, workers = AvailableCores();
};

// Evenly spread over those that came to an end of their own.
std::vector<int64_t> Choose(const std::vector<batch::StoredTrial>& stored, int sample) {
  std::vector<int64_t> ended, chosen;
  for (const batch::StoredTrial& trial : stored)
    if (trial.record.ended()) ended.push_back(trial.trial);
  const int64_t n = std::min<int64_t>(sample, std::ssize(ended));
  for (int64_t i = 0; i < n; ++i)
    chosen.push_back(ended[static_cast<size_t>(i * std::ssize(ended) / n)]);
  return chosen;
}

int Verify(const VerifyArguments& arguments) {
  const batch::ResultStore store = batch::ResultStore::Read(arguments.file);
  const batch::Plan plan = PlanOf(arguments.file, store, arguments.plugins);
  Progress progress(/*quiet=*/false);
  WarnOfOtherBuild(store.header(), &progress);
  std::vector<int64_t> trials = arguments.trials;
  if (trials.empty()) trials = Choose(store.Trials(), arguments.sample);
  for (const int64_t trial : trials) store.Trial(trial);  // all there, before any work

  size_t next = 0, equal = 0, done = 0;
  const auto compare = [&](const batch::StoredTrial& again) {
    const trial::TrialRecord before = store.Trial(again.trial).record;
    const bool same =
        before.digest == again.record.digest && before.outcome == again.record.outcome;
    ++done;
    equal += same;
    if (!same)
      progress.Say(fmt::format("trial {}: {} with digest {}, now {} with digest {}", again.trial,
                               NameOf(before.outcome), before.digest, NameOf(again.record.outcome),
                               again.record.digest));
  };
  batch::TrialRunner runner({.jobs = {.workers = arguments.workers},
                             .time_limit_s = plan.settings().trial_time_limit_s,
                             .plugins = plan.plugins(),
                             .on_progress =
                                 [&](const auto&) {
                                   progress.ShowDone(static_cast<int>(done),
                                                     static_cast<int>(trials.size()), "trials", 10);
                                 },
                             .stop_requested = CatchStopSignals()},
                            nullptr);
  runner.Run(
      batch::SourceOf(plan),
      {.next = [&] { return next < trials.size() ? std::optional(trials[next++]) : std::nullopt; },
       .add = compare});
  progress.Say(fmt::format("{} of {} trials have the same digest again", equal, trials.size()));
  return equal < done ? kExitMismatch : kExitDone;
}

// ------------------------------------------------------------------------------------------ replay

struct ReplayArguments {
  trial::Plugins plugins;
  std::string file;
  int64_t trial = 0;
  std::string out;
  bool no_video = false, json = false, quiet = false;
};

int Replay(const ReplayArguments& arguments) {
  const batch::ResultStore store = batch::ResultStore::Read(arguments.file);
  const batch::Plan plan = PlanOf(arguments.file, store, arguments.plugins);
  const trial::TrialRecord before = store.Trial(arguments.trial).record;
  Progress progress(arguments.quiet);
  WarnOfOtherBuild(store.header(), &progress);
  const std::string out =
      arguments.out.empty() ? fmt::format("out/replay-{}", arguments.trial) : arguments.out;
  const trial::Scenario scenario = plan.ScenarioOf(plan.Trial(arguments.trial));
  const trial::TrialResult result = run::RunShownTrial(scenario, {.inputs = {arguments.file},
                                                                  .out = out,
                                                                  .video = !arguments.no_video,
                                                                  .json = arguments.json,
                                                                  .quiet = arguments.quiet});
  if (StopSignal() != 0 || result.digest == before.digest) return kExitDone;
  throw batch::MismatchError(fmt::format("trial {} ended {} with digest {}, now {} with digest {}",
                                         arguments.trial, NameOf(before.outcome), before.digest,
                                         NameOf(result.outcome), result.digest));
}

}  // namespace

void AddResults(CommandLine& line) {
  auto [merge, merge_arguments] =
      line.Add("merge", "Put the shards of a batch into one file", &Merge);
  merge.Add("out", merge_arguments.out, "The file to make or to add to").Required();
  merge.Add("inputs", merge_arguments.inputs, "Files that batch wrote").Required();
  merge.Flag("--complete", merge_arguments.complete, "Exit with 1 when trials are missing");

  auto [verify, verify_arguments] =
      line.Add("verify", "Run trials again and compare their digests with the stored", &Verify);
  verify_arguments.plugins = line.plugins();
  verify.Add("results", verify_arguments.file, "A batch's file").Required();
  const Option which = verify.Add("--trials TRIAL,...", verify_arguments.trials, "Which ones");
  verify.Add("--sample", verify_arguments.sample, "Else, how many, evenly spread")
      .Positive()
      .Excludes(which);
  verify.AddWorkers(verify_arguments.workers, "Processes");

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
