#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/farm_arguments.h"
#include "experiments/app/plan_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/farm/batch.h"
#include "experiments/farm/plan.h"
#include "experiments/farm/result_store.h"
#include "experiments/farm/summary.h"
#include "experiments/farm/trial_scheduler.h"
#include "experiments/media/figure.h"
#include "experiments/page/batch_page.h"
#include "experiments/report/json.h"
#include "experiments/studies/curve/success_curve.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"

namespace turbidock::app {
namespace {

namespace fs = std::filesystem;

constexpr double kLogEvery_s = 10;
constexpr size_t kMaxRows = 60;  // of the closing table; `status --by` shows longer ones

struct BatchArguments {
  PlanArguments plan;
  std::string out, shard = "1/1";
  FarmArguments farm;
  bool json = false, quiet = false;
};

// "480 trials" or, of a plan with a precision, "up to 480 trials".
std::string CountText(const farm::Plan& plan) {
  return fmt::format("{}{} trials", plan.settings().precision ? "up to " : "", plan.trials());
}

// "17 of 480" or, where the total is a guess, "17 of about 320 (at most 480)".
std::string DoneText(int64_t done, int64_t total, int64_t most) {
  return total == most ? fmt::format("{} of {}", done, total)
                       : fmt::format("{} of about {} (at most {})", done, total, most);
}

std::string Words(const farm::BatchProgress& progress) {
  const statistics::Interval wilson = statistics::WilsonInterval(progress.successes, progress.done);
  std::string words = DoneText(progress.done, progress.total, progress.most) + " trials";
  if (progress.done > 0)
    words += fmt::format(
        ", success {:.0f} % [{:.0f}, {:.0f}]",
        100.0 * static_cast<double>(progress.successes) / static_cast<double>(progress.done),
        100 * wilson.low, 100 * wilson.high);
  if (progress.done_now > 0) {
    const double per_s = static_cast<double>(progress.done_now) / progress.wall_time_s;
    words += fmt::format(", {:.0f} an hour, {} left", 3600 * per_s,
                         Duration(static_cast<double>(progress.total - progress.done) / per_s));
  }
  return words;
}

// In how many of its cells a file has the precision that its plan asks for.
std::string PrecisionText(const farm::TrialRule& rule, const farm::TrialScheduler& scheduler) {
  std::string text = fmt::format("a precision of {:g} % is reached in {} of {} cells",
                                 100 * *rule.precision, scheduler.reached(), scheduler.cells());
  if (scheduler.not_reached() > 0)
    text +=
        fmt::format(", not in {}: max_trials = {} came first", scheduler.not_reached(), rule.most);
  return text;
}

std::vector<std::string> GridKeys(const farm::Plan& plan) {
  std::vector<std::string> keys;
  for (const farm::GridAxis& axis : plan.grid()) keys.push_back(axis.key);
  return keys;
}

int Batch(const BatchArguments& arguments) {
  const farm::Plan plan = arguments.plan.Load(arguments.quiet);
  const farm::Shard shard = farm::ParseShard(arguments.shard);
  // of a part of a batch there is no page
  const std::string page =
      shard.count == 1 ? fs::path(arguments.out).replace_extension(".html").string() : "";
  system::OutputPlan()
      .Reads(arguments.plan.plan)
      .Reads(plan.files())
      .Writes(arguments.out, system::kResultFile)
      .Writes(page, page::kPageFile)
      .Require();
  farm::ResultStore store = farm::ResultStore::Write(arguments.out, farm::HeaderOf(plan, shard));
  Progress progress(arguments.quiet);
  progress.Say(fmt::format("{}: {}{}, plan {}, {}", plan.settings().description, CountText(plan),
                           shard.count > 1 ? ", of which shard " + shard.Text() : "", plan.hash(),
                           system::VersionAndCommit()));
  const auto done_before = std::ssize(store.Done());
  if (done_before > 0)
    progress.Say(fmt::format("  {} of them are in {} already", done_before, arguments.out));

  farm::BatchOptions options;
  options.farm = arguments.farm.For(arguments.out,
                                    [&](const std::string& text) { progress.Say("  " + text); });
  options.stop_requested = CatchStopSignals();
  options.on_progress = [&](const farm::BatchProgress& now) {
    progress.ShowOrSay(static_cast<double>(now.done) / static_cast<double>(now.total), Words(now),
                       kLogEvery_s);
  };
  options.on_trial = [&](const farm::StoredTrial& trial) {
    const trial::TrialRecord& r = trial.record;
    if (!r.ended())
      progress.Say(fmt::format("  trial {} {}: {}", trial.trial, NameOf(r.outcome), r.reason));
  };
  const farm::BatchProgress end = farm::RunBatch(plan, options, &store);
  if (end.done < end.total) {
    progress.Say(fmt::format("stopped: {} trials are in {}; the same command goes on",
                             DoneText(end.done, end.total, end.most), arguments.out));
    return kExitDone;  // main makes the signal's code of it
  }

  const std::vector<std::string> keys = GridKeys(plan);
  const std::vector<farm::GroupSummary> groups = farm::Summarise(store.Trials(), keys);
  const farm::TrialRule rule = farm::RuleOf(store.header());
  progress.Say("");
  progress.Say(groups.size() <= kMaxRows
                   ? farm::SummaryTable(keys, groups, rule.precision)
                   : farm::SummaryTable({}, farm::Summarise(store.Trials(), {})));
  if (rule.precision) progress.Say(PrecisionText(rule, farm::SchedulerOf(store)));
  if (end.done_now > 0)
    progress.Say(fmt::format(
        "{} trials in {}, {:.0f} an hour, workers busy {:.1f} % of the time; results in {}",
        end.done_now, Duration(end.wall_time_s),
        3600 * static_cast<double>(end.done_now) / end.wall_time_s,
        100 * end.worker_time_s /
            (end.wall_time_s *
             static_cast<double>(std::min<int64_t>(options.farm.capacity(), end.done_now))),
        arguments.out));
  if (!page.empty()) {
    page::WritePage(page, page::BatchPage(store, arguments.out, {.plugins = plan.plugins()}));
    progress.Say("a page to look at: " + page);
  }
  if (arguments.json) std::fputs(farm::SummaryJson(keys, groups, rule.precision).c_str(), stdout);
  return kExitDone;
}

struct StatusArguments {
  std::string file;
  std::vector<std::string> by;
  bool json = false;
};

int Status(const StatusArguments& arguments) {
  const farm::ResultStore store = farm::ResultStore::Read(arguments.file);
  const farm::StoreHeader& header = store.header();
  const std::vector<farm::StoredTrial> trials = store.Trials();
  const farm::TrialRule rule = farm::RuleOf(header);
  const farm::TrialScheduler scheduler = farm::SchedulerOf(store);
  const bool running = farm::IsLocked(arguments.file);
  const std::vector<farm::GroupSummary> groups = farm::Summarise(trials, arguments.by);
  if (arguments.json) {
    report::Json json = {{"kind", header.kind},
                         {"plan_hash", header.plan_hash()},
                         {"build", header.build},
                         {"shard", header.shard.Text()},
                         {"trials", scheduler.wanted()},
                         {"done", std::ssize(trials)},
                         {"running", running}};
    if (rule.precision)
      json["precision"] = {{"half_width", *rule.precision},
                           {"max_trials", rule.most},
                           {"cells", scheduler.cells()},
                           {"reached", scheduler.reached()},
                           {"not_reached", scheduler.not_reached()}};
    json["groups"] =
        report::ParseJson(farm::SummaryJson(arguments.by, groups, rule.precision), "groups");
    fmt::print("{}", report::JsonText(json));
    return kExitDone;
  }
  fmt::print("{}: {}, plan {}, written by {}{}\n", system::OneLineOf(arguments.file), header.kind,
             header.plan_hash(), header.build,
             header.shard.count > 1 ? ", shard " + header.shard.Text() : "");
  // How many a gate or a tuning run will have, the file does not say.
  const bool complete = std::ssize(trials) == scheduler.wanted(), is_batch = header.kind == "batch";
  fmt::print("{} trials, {}\n",
             !is_batch  ? std::to_string(std::ssize(trials))
             : complete ? DoneText(std::ssize(trials), scheduler.wanted(), scheduler.wanted())
                        : DoneText(std::ssize(trials), scheduler.Expected(), scheduler.most()),
             running                ? "running"
             : complete && is_batch ? "complete"
             : is_batch             ? "not running: start it again to finish it"
                                    : "not running");
  if (rule.precision) fmt::print("{}\n", PrecisionText(rule, scheduler));
  fmt::print("\n");
  if (!trials.empty()) fmt::print("{}", farm::SummaryTable(arguments.by, groups, rule.precision));
  return kExitDone;
}

struct CurveArguments {
  std::string file, over, by, figure;
  bool error = false, json = false;
};

int Curve(const CurveArguments& arguments) {
  system::OutputPlan().Reads(arguments.file).Writes(arguments.figure).Require();
  const farm::ResultStore store = farm::ResultStore::Read(arguments.file);
  const std::vector<farm::StoredTrial> trials = store.Trials();
  if (!arguments.figure.empty()) media::RequireFigurePath(arguments.figure);
  if (trials.empty()) throw ConfigError(arguments.file + ": has no trials yet");
  const auto curves = curve::SuccessCurves(trials, arguments.over, arguments.by);
  if (!arguments.figure.empty())
    curve::WriteSuccessFigure(arguments.figure, page::TitleOf(store.header()), arguments.over,
                              curves, arguments.error);
  std::fputs((arguments.json ? curve::SuccessJson(arguments.over, curves)
                             : curve::SuccessTable(arguments.over, curves))
                 .c_str(),
             stdout);
  return kExitDone;
}

}  // namespace

void AddBatch(CommandLine& line) {
  auto [batch, arguments] =
      line.Add("batch", "Run the trials of a plan; what is done already is not run again", &Batch);
  arguments.plan.AddTo(&batch, line.plugins());
  batch
      .Add("--out FILE", arguments.out,
           "SQLite file for the results; at the end a page beside it, .html, shows them")
      .Required();
  arguments.farm.AddTo(&batch, "Processes; results do not depend on it", AvailableCores());
  batch.Add("--shard I/N", arguments.shard, "Run part I of N only; merge puts them together");
  batch.Flag("--json", arguments.json, "Print the summary as JSON on stdout");
  batch.AddQuiet(arguments.quiet);

  auto [status, status_arguments] =
      line.Add("status", "How far a batch is and what came out so far", &Status);
  status.Add("results", status_arguments.file, "A batch's file").Required();
  status.Add("--by KEY,...", status_arguments.by,
             "Group the table by these: parameters, outcome, failure");
  status.Flag("--json", status_arguments.json, "As JSON on stdout");

  auto [curve, curve_arguments] =
      line.Add("curve", "Success rate over one varied key, and where it falls to 50 %", &Curve);
  curve.Add("results", curve_arguments.file, "A batch's file").Required();
  curve.Add("--over KEY", curve_arguments.over, "The key on the horizontal axis").Required();
  curve.Add("--by KEY", curve_arguments.by, "One curve for each value of this key");
  const Option figure =
      curve.Add("--figure FILE", curve_arguments.figure, "Draw it: .png, .svg or .pdf");
  curve
      .Flag("--error", curve_arguments.error,
            "Draw beside it how far the estimate is from the truth once docked")
      .Needs(figure);
  curve.Flag("--json", curve_arguments.json, "As JSON on stdout");
}

}  // namespace turbidock::app
