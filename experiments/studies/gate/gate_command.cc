#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/job_arguments.h"
#include "experiments/app/plan_arguments.h"
#include "experiments/app/print_report.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/page/report_page.h"
#include "experiments/report/report_json.h"
#include "experiments/report/text.h"
#include "experiments/studies/gate/gate.h"
#include "experiments/studies/gate/gate_report.h"
#include "experiments/studies/run/shown_trial.h"
#include "experiments/system/output_path.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

namespace fs = std::filesystem;

struct GateArguments {
  trial::Plugins plugins;
  std::string plan, baseline, out, figure;
  std::vector<std::string> assignments;
  app::JobArguments jobs;
  int bundles = 5;
  bool update = false, plan_size = false, json = false, quiet = false;

  std::string failures() const { return out + "/failures"; }
};

// With what the gate reads.
system::OutputPlan OutputsOf(const GateArguments& arguments, const GatePlan& plan) {
  system::OutputPlan outputs;
  outputs.Reads(arguments.plan);
  for (const GateCondition& condition : plan.conditions) outputs.Reads(condition.scenario_file);
  return outputs;
}

// The gate's trials in worker processes, and their file unless its name is empty.
class Trials {
 public:
  Trials(const GateArguments& arguments, const GatePlan& plan, const std::string& file,
         app::Progress* progress) {
    if (!file.empty()) {
      store_.emplace(OpenTrials(file, plan, [&](const std::string& text) { progress->Say(text); }));
      if (const auto there = std::ssize(store_->Done()); there > 0)
        progress->Say(fmt::format("  {} trials are in {} already", there, file));
    }
    const batch::JobOptions jobs =
        arguments.jobs.For(arguments.out.empty() ? "" : arguments.out + "/trials",
                           [progress](const std::string& text) { progress->Say("  " + text); });
    run_ = MakeGateRunner(plan, {.jobs = jobs, .stop_requested = app::CatchStopSignals()},
                          store_ ? &*store_ : nullptr);
  }

  const GateRunner& run() const { return run_; }

 private:
  std::optional<batch::ResultStore> store_;
  GateRunner run_;
};

GateProgress ShowOn(app::Progress* progress) {
  return [progress](int done, int wanted) {
    progress->ShowDone(done, wanted, "trials", /*every_s=*/10);
  };
}

// The baseline that is replaced; an empty one where there is none, or none that can be read.
Baseline OldBaseline(const std::string& file, app::Progress* progress) {
  if (!fs::exists(file)) return {};
  try {
    return LoadBaseline(file);
  } catch (const ConfigError& error) {
    progress->Say(std::string("the old baseline cannot be compared: ") + error.what());
    return {};
  }
}

int UpdateBaseline(const GateArguments& arguments, const GatePlan& plan) {
  // Until the baseline is written, its trials are beside it.
  const std::string trials = plan.baseline + ".trials.db";
  OutputsOf(arguments, plan)
      .Writes(plan.baseline, kBaselineFile)
      .Writes(trials, system::kResultFile)
      .Require();
  app::Progress progress(arguments.quiet);
  const Baseline now =
      MeasureBaseline(plan, Trials(arguments, plan, trials, &progress).run(), ShowOn(&progress));
  const Baseline before = OldBaseline(plan.baseline, &progress);
  system::WriteWhole(plan.baseline, BaselineText(now));
  fs::remove(trials);
  progress.Say(ChangeTable(before, now).Text() + "written to " + plan.baseline);
  return app::kExitDone;
}

// What it takes to look into a trial: it runs once more, with all files and, where there are
// cameras, a video, into FOLDER/CONDITION_SEED/; replay.txt says how to run it again.
void WriteBundle(const std::string& folder, const GateCondition& condition,
                 const std::vector<std::string>& assignments, const GateTrial& trial) {
  const std::string bundle = folder + "/" + BundleName(condition.name, trial.seed);
  const trial::Scenario scenario = condition.Load(assignments, trial.seed);
  const bool films = scenario.pose_source == trial::PoseSource::kCameras;
  const trial::TrialResult again =
      run::RunShownTrial(scenario, {.out = bundle, .video = films, .quiet = true});
  if (app::StopSignal() != 0) throw batch::Stopped();
  if (again.digest != trial.digest)
    throw SimulatorFault(fmt::format("{}: the trial does not repeat: digest {}, in the gate {}",
                                     bundle, again.digest, trial.digest));
  system::WriteWhole(bundle + "/replay.txt",
                     fmt::format("condition: {}\nseed: {}\noutcome: {}\ndigest: {}\n\n"
                                 "turbidock run resolved.yaml --out replay{}\n",
                                 condition.name, trial.seed, NameOf(trial.outcome), trial.digest,
                                 films ? " --video" : ""));
}

// For seeds that docked before and no longer do, up to the number asked for.
void WriteBundles(const GateArguments& arguments, const GatePlan& plan, const GateReport& report,
                  app::Progress* progress) {
  int left = arguments.bundles;
  for (size_t i = 0; i < report.conditions.size(); ++i)
    for (const int64_t seed : report.conditions[i].newly_failing_seeds) {
      if (left-- <= 0) return;
      const ConditionReport& condition = report.conditions[i];
      const GateTrial& trial = *std::ranges::find(condition.trials, seed, &GateTrial::seed);
      WriteBundle(arguments.failures(), plan.conditions[i], plan.assignments, trial);
      progress->Say(fmt::format("  {}, seed {}: {}; in {}", condition.name, seed,
                                NameOf(trial.outcome), arguments.failures()));
    }
}

// The folder of --out, once the verdict is known.
void WriteOut(const GateArguments& arguments, const GatePlan& plan, const GateReport& report,
              app::Progress* progress) {
  const fs::path out(arguments.out);
  const report::Report shown = ReportOf(report);
  const report::Json document = report::Document(shown, report);
  system::WriteWhole(out / "summary.json", report::JsonText(document));
  system::WriteWhole(out / "junit.xml", Junit(report));
  system::WriteWhole(out / "summary.md", report::Markdown(shown));
  progress->Say("summary.json, junit.xml and summary.md in " + arguments.out);
  WriteBundles(arguments, plan, report, progress);
  page::Page page = page::ReportPage(document, arguments.out);
  page::AddTrialsIn(arguments.failures(), plan.plugins, &page);
  page::WritePage((out / "report.html").string(), page);
  progress->Say("a page to look at: " + (out / "report.html").string());
}

// A report on stdout and, where one is asked for, as a figure.
void Show(const report::Report& report, const report::Json& result,
          const GateArguments& arguments) {
  app::PrintReport(report, result, arguments.json);
  if (!arguments.figure.empty()) media::WriteFigure(arguments.figure, media::FigureOf(report));
}

int JudgeAgainstBaseline(const GateArguments& arguments, const GatePlan& plan) {
  const Baseline baseline = LoadBaseline(plan.baseline);
  RequireSamePlan(plan, baseline, plan.baseline);
  system::OutputPlan outputs = OutputsOf(arguments, plan);
  outputs.Reads(plan.baseline).Writes(arguments.figure);
  std::string trials;
  if (!arguments.out.empty()) {
    trials = arguments.out + "/trials.db";
    outputs.WritesInto(arguments.out, {"summary.json", "junit.xml", "summary.md"})
        .Writes(arguments.out + "/report.html", page::kPageFile)
        .Writes(trials, system::kResultFile);
    if (arguments.bundles > 0) outputs.WritesInto(arguments.failures(), {});
  }
  outputs.Require();
  app::Progress progress(arguments.quiet);
  const GateReport report =
      RunGate(plan, baseline, Trials(arguments, plan, trials, &progress).run(), ShowOn(&progress));
  Show(ReportOf(report), report, arguments);
  if (!arguments.out.empty()) WriteOut(arguments, plan, report, &progress);
  if (report.verdict == statistics::Verdict::kPass) return app::kExitDone;
  return report.verdict == statistics::Verdict::kFail ? app::kExitCheckFailed
                                                      : app::kExitInconclusive;
}

int Gate(const GateArguments& arguments) {
  GatePlan plan = LoadGatePlan(arguments.plan, arguments.plugins);
  plan.assignments = arguments.assignments;
  if (!arguments.baseline.empty()) plan.baseline = arguments.baseline;
  if (arguments.plan_size) {
    Show(SizeReport(plan), SizesOf(plan), arguments);
    return app::kExitDone;
  }
  try {
    return arguments.update ? UpdateBaseline(arguments, plan)
                            : JudgeAgainstBaseline(arguments, plan);
  } catch (const batch::Stopped&) {
    if (!arguments.quiet && (arguments.update || !arguments.out.empty()))
      std::fputs("stopped; the same command goes on\n", stderr);
    return app::kExitInconclusive;  // main makes it the signal's
  }
}

}  // namespace

void AddGate(app::CommandLine& line) {
  auto [gate, arguments] =
      line.Add("gate", "Compare docking with a committed baseline: pass, fail or neither", &Gate);
  arguments.plugins = line.plugins();
  gate.Footer(
      "Exit codes: 0 pass, 1 fail, 2 bad input, 3 inconclusive: the trials allowed are spent,\n"
      "4 a trial could not be run.");
  gate.Add("gate", arguments.plan, "The gate's YAML file").Required();
  app::Option baseline =
      gate.Add("--baseline", arguments.baseline, "Another baseline file than the gate's");
  const app::Option out =
      gate.Add("--out", arguments.out,
               "Folder for report.html, summary.json, junit.xml, summary.md, failures/");
  const app::Option figure = gate.AddFigure(arguments.figure, "Draw what the report shows");
  const app::JobArguments::Options jobs =
      arguments.jobs.AddTo(&gate, "Processes that run trials", app::AvailableCores());
  const app::Option set = gate.AddSet(
      arguments.assignments, "Set one scenario key in every condition, as if the build had it so");
  const app::Option bundles =
      gate.Add("--bundles", arguments.bundles,
               "Trials with video of newly failing seeds in failures/, at most")
          .NotNegative();
  app::Option update = gate.Flag("--update", arguments.update,
                                 "Measure the baseline anew, write it, and say what changed");
  app::Option plan_size =
      gate.Flag("--plan-size", arguments.plan_size,
                "Run nothing: how many trials each condition takes, and which loss it notices");
  const app::Option json =
      gate.Flag("--json", arguments.json, "Print the report as JSON on stdout: summary.json");
  gate.AddQuiet(arguments.quiet);
  for (const app::Option& option : {out, figure, set, bundles, json}) update.Excludes(option);
  for (const app::Option& option :
       {out, figure, set, bundles, update, baseline, jobs.workers, jobs.slurm})
    plan_size.Excludes(option);
}

}  // namespace turbidock::gate
