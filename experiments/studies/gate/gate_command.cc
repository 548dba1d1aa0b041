#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "experiments/command/command_line.h"
#include "experiments/command/job_arguments.h"
#include "experiments/command/progress.h"
#include "experiments/command/report_output.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/page/report_page.h"
#include "experiments/report/report.h"
#include "experiments/report/report_json.h"
#include "experiments/studies/gate/gate.h"
#include "experiments/studies/run/shown_trial.h"
#include "experiments/system/output_path.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

namespace fs = std::filesystem;

struct GateArguments {
  trial::Plugins plugins;
  std::string plan, baseline, out;
  std::vector<std::string> assignments;
  std::string gains;
  command::JobArguments jobs;
  int bundles = 5;
  bool update = false, json = false, quiet = false, anew = false;

  std::string failures() const { return out + "/failures"; }
};

// The file that keeps the trials until there is a baseline or, of --out, for good; else none.
std::string TrialsFile(const GateArguments& arguments, const GatePlan& plan) {
  if (arguments.update) return plan.baseline + ".trials.db";
  return arguments.out.empty() ? "" : arguments.out + "/trials.db";
}

// Runs the gate's trials in worker processes and keeps them in a file, unless its name is empty.
GateRunner RunnerOf(const GateArguments& arguments, const GatePlan& plan, const std::string& file,
                    command::Progress* progress) {
  const auto say = [progress](const std::string& text) { progress->Say("  " + text); };
  std::shared_ptr<batch::ResultStore> store;
  if (!file.empty()) {
    store = std::make_shared<batch::ResultStore>(OpenTrials(file, plan, arguments.anew, say));
    if (const auto there = std::ssize(store->Done()); there > 0)
      say(fmt::format("{} trials are in {} already", there, file));
  }
  const std::string beside = arguments.out.empty() ? "" : arguments.out + "/trials";
  const batch::RunOptions options{.jobs = arguments.jobs.For(beside, say),
                                  .stop_requested = command::CatchStopSignals()};
  return [store, run = MakeGateRunner(plan, options, store.get())](const GateTrials& trials) {
    run(trials);
  };
}

GateProgress ShowOn(command::Progress* progress) {
  return [progress](int64_t done, int64_t wanted) {
    progress->ShowDone(static_cast<int>(done), static_cast<int>(wanted), "trials", /*every_s=*/10);
  };
}

int UpdateBaseline(const GateArguments& arguments, const GatePlan& plan,
                   system::OutputPlan outputs) {
  const std::string trials = TrialsFile(arguments, plan);
  outputs.Writes(plan.baseline, kBaselineFile).Writes(trials, system::kResultFile).Require();
  command::Progress progress(arguments.quiet);
  const Baseline now =
      MeasureBaseline(plan, RunnerOf(arguments, plan, trials, &progress), ShowOn(&progress));
  system::WriteWhole(plan.baseline, BaselineText(now));
  fs::remove(trials);
  for (const BaselineCondition& c : now.conditions)
    progress.Say(fmt::format("{}: {} of {} docked", c.name, c.docked, c.trials));
  progress.Say("written to " + plan.baseline + ", a line a trial: a diff shows what changed");
  return command::kExitDone;
}

// What it takes to look into seeds that docked before and no longer do, up to the number asked for:
// each runs once more, with all files and, where there are cameras, a video, into
// failures/CONDITION_SEED/.
void WriteBundles(const GateArguments& arguments, const GatePlan& plan, const GateReport& report,
                  command::Progress* progress) {
  int left = arguments.bundles;
  for (size_t i = 0; i < report.conditions.size(); ++i)
    for (const GateTrial& trial : report.conditions[i].outcomes) {
      if (std::ranges::count(report.conditions[i].newly_failing_seeds, trial.seed) == 0) continue;
      if (left-- <= 0) return;
      const GateCondition& condition = plan.conditions[i];
      const std::string bundle =
          arguments.failures() + "/" + BundleName(condition.name, trial.seed);
      const trial::Scenario scenario = ScenarioOf(condition, trial.seed);
      const bool films = scenario.pose_source == trial::PoseSource::kCameras;
      const trial::TrialResult again =
          run::RunShownTrial(scenario, {.out = bundle, .video = films, .quiet = true});
      if (command::StopSignal() != 0) throw batch::Stopped();
      if (again.digest != trial.digest)
        throw SimulatorFault(fmt::format("{}: the trial does not repeat: digest {}, in the gate {}",
                                         bundle, again.digest, trial.digest));
      progress->Say(fmt::format("  {}, seed {}: {}; in {}", condition.name, trial.seed,
                                NameOf(trial.outcome), bundle));
    }
}

// What a seed that changed opens in the page: how to run it, unless a bundle takes its place.
report::Json LinksOf(const GatePlan& plan, const GateReport& report) {
  report::Json links = report::Json::object();
  for (size_t i = 0; i < report.conditions.size(); ++i) {
    const ConditionReport& condition = report.conditions[i];
    std::string set;
    for (const std::string& key : plan.conditions[i].keys)
      set += fmt::format(" --set '{}={}'", key, config::TextOf(plan.conditions[i].resolved, key));
    for (const std::string& assignment : plan.assignments)
      set += fmt::format(" --set '{}'", assignment);
    for (const GateTrial& trial : condition.outcomes) {
      const bool fails = std::ranges::count(condition.newly_failing_seeds, trial.seed) > 0;
      if (!fails && std::ranges::count(condition.newly_docking_seeds, trial.seed) == 0) continue;
      const std::string name = BundleName(condition.condition, trial.seed);
      links[name] = page::Link{
          .title = fmt::format("{}, seed {}", condition.condition, trial.seed),
          .trials = {{.title = fails ? "fails now" : "docks now",
                      .outcome = NameOf(trial.outcome),
                      .reason = "",
                      .note = "Its traces are not kept: the gate ran it without (--bundles).",
                      .commands = {{"The trial again, with film and all its files",
                                    fmt::format("turbidock run {} --seed {}{} --video --out out/{}",
                                                plan.conditions[i].scenario_file, trial.seed, set,
                                                name)}}}}};
    }
  }
  return links;
}

// The folder of --out, once the verdict is known.
void WriteOut(const GateArguments& arguments, const GatePlan& plan, const GateReport& report,
              command::Progress* progress) {
  const fs::path out(arguments.out);
  const report::Report shown = ReportOf(report);
  report::Json document = report::Document(shown, report);
  document["links"] = LinksOf(plan, report);
  system::WriteWhole(out / "summary.json", report::JsonText(document));
  system::WriteWhole(out / "junit.xml", Junit(report));
  system::WriteWhole(out / "summary.md", report::Markdown(shown));
  WriteBundles(arguments, plan, report, progress);
  page::Page page = page::ReportPage(document, arguments.out);
  page::AddTrialsIn(arguments.failures(), arguments.plugins, &page);
  page::WritePage((out / "report.html").string(), page);
  progress->Say("report.html, summary.json, junit.xml and summary.md in " + arguments.out);
}

int JudgeAgainstBaseline(const GateArguments& arguments, const GatePlan& plan,
                         system::OutputPlan outputs) {
  const Baseline baseline = LoadBaseline(plan.baseline);
  RequireSamePlan(plan, baseline, plan.baseline);
  outputs.Reads(plan.baseline);
  const std::string trials = TrialsFile(arguments, plan);
  if (!arguments.out.empty()) {
    outputs.WritesInto(arguments.out, {"summary.json", "junit.xml", "summary.md"})
        .Writes(arguments.out + "/report.html", page::kPageFile)
        .Writes(trials, system::kResultFile);
    if (arguments.bundles > 0) outputs.WritesInto(arguments.failures(), {});
  }
  outputs.Require();
  if (!arguments.out.empty()) system::MakeFolder(arguments.out);
  command::Progress progress(arguments.quiet);
  const GateReport report =
      RunGate(plan, baseline, RunnerOf(arguments, plan, trials, &progress), ShowOn(&progress));
  command::PrintReport(ReportOf(report), report, arguments.json);
  if (!arguments.out.empty()) WriteOut(arguments, plan, report, &progress);
  if (report.verdict == statistics::Verdict::kPass) return command::kExitDone;
  return report.verdict == statistics::Verdict::kFail ? command::kExitCheckFailed
                                                      : command::kExitInconclusive;
}

int Gate(const GateArguments& arguments) {
  GatePlan plan = LoadGatePlan(arguments.plan, arguments.plugins,
                               trial::GivenBy(arguments.gains, arguments.assignments));
  if (!arguments.baseline.empty()) plan.baseline = arguments.baseline;
  system::OutputPlan outputs;  // with what the gate reads
  outputs.Reads(arguments.plan);
  for (const GateCondition& condition : plan.conditions) outputs.Reads(condition.scenario_file);
  try {
    return arguments.update ? UpdateBaseline(arguments, plan, outputs)
                            : JudgeAgainstBaseline(arguments, plan, outputs);
  } catch (const batch::Stopped&) {
    const std::string trials = TrialsFile(arguments, plan);
    command::Progress(arguments.quiet)
        .Say(trials.empty()
                 ? "stopped: without --out no trial is kept"
                 : "stopped: the trials so far are in " + trials + "; the same command goes on");
    return command::kExitInconclusive;  // main makes it the signal's
  }
}

}  // namespace

void AddGate(command::CommandLine& line) {
  auto [gate, arguments] =
      line.Add("gate", "Compare docking with a committed baseline: pass, fail or neither", &Gate);
  arguments.plugins = line.plugins();
  gate.Footer(
      "Exit codes: 0 pass, 1 fail, 2 bad input, 3 inconclusive: the trials allowed are spent,\n"
      "4 a trial could not be run.");
  gate.Add("gate", arguments.plan, "The gate's YAML file").Required();
  gate.Add("--baseline", arguments.baseline, "Another baseline file than the gate's");
  const command::Option out =
      gate.Add("--out", arguments.out,
               "Folder for report.html, summary.json, junit.xml, summary.md, failures/");
  arguments.jobs.AddTo(&gate, "Processes that run trials");
  const command::Option set = gate.AddSet(
      arguments.assignments, "Set one scenario key in every condition, as if the build had it so");
  const command::Option gains = gate.AddGains(arguments.gains);
  const command::Option bundles =
      gate.Add("--bundles", arguments.bundles,
               "Trials with video of newly failing seeds in failures/, at most")
          .NotNegative();
  command::Option update =
      gate.Flag("--update", arguments.update, "Measure the baseline anew and write it");
  const command::Option json =
      gate.Flag("--json", arguments.json, "Print the report as JSON on stdout: summary.json");
  gate.AddAnew(arguments.anew);
  gate.AddQuiet(arguments.quiet);
  for (const command::Option& option : {out, set, gains, bundles, json}) update.Excludes(option);
}

}  // namespace turbidock::gate
