#include <fmt/format.h>

#include <filesystem>
#include <vector>

#include "experiments/batch/batch.h"
#include "experiments/batch/batch_report.h"
#include "experiments/batch/job_pool.h"
#include "experiments/batch/plan.h"
#include "experiments/batch/result_store.h"
#include "experiments/batch/runner.h"
#include "experiments/command/command_line.h"
#include "experiments/command/job_arguments.h"
#include "experiments/command/progress.h"
#include "experiments/command/report_output.h"
#include "experiments/page/batch_page.h"
#include "experiments/report/report.h"
#include "experiments/studies/dataset/dataset.h"
#include "experiments/studies/recognition/calibration.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"

namespace turbidock::app {
namespace {

namespace fs = std::filesystem;

constexpr double kLogEvery_s = 10;

struct BatchArguments {
  command::PlanArguments plan;
  std::string out, shard = "1/1";
  command::JobArguments jobs;
  bool json = false, quiet = false, anew = false;
};

std::string Words(const batch::BatchProgress& progress) {
  if (progress.done == 0) return "trials";
  const statistics::Interval wilson = statistics::WilsonInterval(progress.successes, progress.done);
  return fmt::format(
      "trials, success {:.0f} % [{:.0f}, {:.0f}]",
      100.0 * static_cast<double>(progress.successes) / static_cast<double>(progress.done),
      100 * wilson.low, 100 * wilson.high);
}

int Batch(const BatchArguments& arguments) {
  const batch::Plan plan = arguments.plan.Load();
  const batch::Shard shard = batch::ParseShard(arguments.shard);
  // of a part of a batch there is no page
  const std::string page =
      shard.count == 1 ? fs::path(arguments.out).replace_extension(".html").string() : "";
  system::OutputPlan outputs;
  outputs.Reads(arguments.plan.plan)
      .Reads(plan.files())
      .Writes(arguments.out, system::kResultFile)
      .Writes(page, page::kPageFile);
  outputs.Require();
  command::Progress progress(arguments.quiet);
  batch::RunOptions options;
  options.stop_requested = command::CatchStopSignals();
  options.jobs = arguments.jobs.For(arguments.out,
                                    [&](const std::string& text) { progress.Say("  " + text); });
  batch::ResultStore store =
      batch::OpenResults(arguments.out, plan, shard, arguments.anew, options.jobs);
  outputs.RemoveOld();
  progress.Say(fmt::format("{}: {}{} trials{}, plan {}, {}", plan.title(),
                           plan.decides() ? "up to " : "", plan.most(),
                           shard.count > 1 ? ", of which shard " + shard.Text() : "", plan.hash(),
                           system::VersionAndCommit()));
  for (const std::string& remark : plan.remarks()) progress.Say("  " + remark);
  if (const auto done = std::ssize(store.Done()); done > 0)
    progress.Say(fmt::format("  {} of them are in {} already", done, arguments.out));
  const auto on_progress = [&](const batch::BatchProgress& now) {
    progress.ShowDone(now.done, now.total, now.most, Words(now), kLogEvery_s);
  };
  options.on_trial = [&](const batch::StoredTrial& trial) {
    const trial::TrialRecord& r = trial.record;
    if (!r.ended())
      progress.Say(fmt::format("  trial {} {}: {}", trial.trial, NameOf(r.outcome), r.reason));
  };
  const batch::BatchProgress end = batch::RunBatch(plan, options, on_progress, &store);
  if (end.done < end.total) {
    progress.Say(fmt::format("stopped: {} trials are in {}; the same command goes on",
                             batch::DoneText(end.done, end.total, end.most), arguments.out));
    return command::kExitDone;  // main makes the signal's code of it
  }
  const batch::BatchSummary summary = batch::SummaryOf(store, arguments.out);
  command::PrintReport(batch::ReportOf(summary), batch::ResultJson(summary), arguments.json);
  if (end.done_now > 0)
    progress.Say(fmt::format("{} trial{} in {}, {:.0f} an hour; results in {}", end.done_now,
                             end.done_now == 1 ? "" : "s", command::Duration(end.wall_time_s),
                             3600 * static_cast<double>(end.done_now) / end.wall_time_s,
                             arguments.out));
  if (!page.empty()) {
    page::WritePage(page, page::BatchPage(store, arguments.out, {.plugins = plan.plugins()}));
    progress.Say("a page to look at: " + page);
  }
  return command::kExitDone;
}

struct StatusArguments {
  std::string file;
  batch::BatchReportOptions report;
  bool json = false;
};

int Status(const StatusArguments& arguments) {
  const batch::ResultStore store = batch::ResultStore::Read(arguments.file);
  const batch::BatchSummary summary = batch::SummaryOf(store, arguments.file, arguments.report);
  command::PrintReport(batch::ReportOf(summary), batch::ResultJson(summary), arguments.json);
  return command::kExitDone;
}

struct SlurmTaskArguments {
  std::string folder;
  int task = 0, workers = 1;
  trial::Plugins plugins;
};

int SlurmTask(const SlurmTaskArguments& arguments) {
  batch::RunSlurmTask(arguments.folder, arguments.task, arguments.workers,
                      {batch::TrialWork(arguments.plugins), dataset::ShardWork(arguments.plugins),
                       recognition::CellWork(arguments.plugins), recognition::EvaluationWork()});
  return command::kExitDone;
}

}  // namespace

void AddBatch(command::CommandLine& line) {
  auto [batch, arguments] =
      line.Add("batch", "Run the trials of a plan; what is done already is not run again", &Batch);
  arguments.plan.AddTo(&batch, line.plugins());
  batch
      .Add("--out FILE", arguments.out,
           "SQLite file for the results; at the end a page beside it, .html, shows them")
      .Required();
  arguments.jobs.AddTo(&batch, "Processes; results do not depend on it");
  batch.Add("--shard I/N", arguments.shard, "Run part I of N only; merge puts them together");
  batch.AddAnew(arguments.anew);
  batch.AddJson(arguments.json);
  batch.AddQuiet(arguments.quiet);

  auto [status, status_arguments] =
      line.Add("status", "How far a batch is and what came out so far", &Status);
  status.Add("results", status_arguments.file, "A batch's file").Required();
  status.Add("--by KEY,...", status_arguments.report.by,
             "Group the table by these: parameters, outcome, failure");
  status.Add("--over KEY", status_arguments.report.over,
             "Where success over this parameter falls to 50 %, for each value of --by");
  status.Flag("--json", status_arguments.json, "As JSON on stdout");

  auto [task, task_arguments] =
      line.Add("slurm-task", "What a task of --slurm runs; not for people", &SlurmTask);
  task.Hidden();
  task_arguments.plugins = line.plugins();
  task.Add("folder", task_arguments.folder, "The array's folder").Required();
  task.Add("--task", task_arguments.task, "Its number in the array").Required().NotNegative();
  task.AddWorkers(task_arguments.workers, "Processes");
}

}  // namespace turbidock::app
