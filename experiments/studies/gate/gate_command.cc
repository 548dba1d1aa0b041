#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/farm_arguments.h"
#include "experiments/app/plan_arguments.h"
#include "experiments/app/print_report.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/page/report_page.h"
#include "experiments/report/report_json.h"
#include "experiments/report/text.h"
#include "experiments/studies/gate/gate.h"
#include "experiments/studies/gate/gate_design.h"
#include "experiments/studies/gate/gate_report.h"
#include "experiments/studies/gate/gate_size.h"
#include "experiments/studies/gate/trial_runner.h"
#include "experiments/studies/run/shown_trial.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

namespace fs = std::filesystem;

struct GateArguments {
  trial::Plugins plugins;
  std::string plan;
  std::string baseline, out, figure;
  std::vector<std::string> assignments;
  app::FarmArguments farm;
  int bundles = 5;
  bool update = false, json = false, quiet = false;

  std::string design, results;
  double budget_s = 240;
  bool plan_size = false;
  double rate = 0.95, margin = 0.1, alpha = 0.05, beta = 0.05;
};

constexpr double kLogEvery_s = 10;

// Trials asked for at once: enough that no worker waits for the slowest of a round for long.
int AtOnce(const farm::FarmOptions& farm) { return 2 * farm.capacity(); }

farm::FarmOptions FarmOf(const GateArguments& arguments, app::Progress* progress) {
  return arguments.farm.For(arguments.out.empty() ? "" : arguments.out + "/trials",
                            [progress](const std::string& text) { progress->Say("  " + text); });
}

std::string FailuresOf(const GateArguments& arguments) { return arguments.out + "/failures"; }
std::string TrialsOf(const GateArguments& arguments) { return arguments.out + "/trials.db"; }

// What every question ends with: the report on stdout and, where one is asked for, as a figure.
void Show(const report::Report& report, const report::Json& result,
          const GateArguments& arguments) {
  app::PrintReport(report, result, arguments.json);
  if (!arguments.figure.empty()) media::WriteFigure(arguments.figure, media::FigureOf(report));
}

// With what the gate reads.
system::OutputPlan OutputsOf(const GateArguments& arguments, const GatePlan& plan) {
  system::OutputPlan outputs;
  outputs.Reads(arguments.plan);
  for (const GateCondition& condition : plan.conditions) outputs.Reads(condition.scenario_file);
  return outputs;
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

farm::RunOptions RunOf(const farm::FarmOptions& farm) {
  return {.farm = farm, .stop_requested = app::CatchStopSignals()};
}

// The file of trials to go on with; `outputs` has been looked at.
farm::ResultStore TrialsIn(const std::string& file, const GatePlan& plan,
                           const std::vector<std::string>& assignments, app::Progress* progress) {
  farm::ResultStore store =
      OpenTrials(file, plan, assignments, [&](const std::string& text) { progress->Say(text); });
  if (const auto there = std::ssize(store.Done()); there > 0)
    progress->Say(fmt::format("  {} trials are in {} already", there, file));
  return store;
}

int UpdateBaseline(const GateArguments& arguments, const GatePlan& plan) {
  // Until the baseline is written, its trials are beside it.
  const std::string trials = plan.baseline + ".trials.db";
  OutputsOf(arguments, plan)
      .Writes(plan.baseline, kBaselineFile)
      .Writes(trials, system::kResultFile)
      .Require();
  app::Progress progress(arguments.quiet);
  const farm::FarmOptions farm = FarmOf(arguments, &progress);
  Baseline now;
  {
    farm::ResultStore store = TrialsIn(trials, plan, {}, &progress);
    now = MeasureBaseline(
        plan, MakeGateRunner(plan, {}, RunOf(farm), &store), AtOnce(farm),
        [&](int done, int all) { progress.ShowDone(done, all, "trials", kLogEvery_s); });
  }
  now.build = system::BuildId();
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
  if (app::StopSignal() != 0) throw farm::Stopped();
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
  for (size_t i = 0; i < report.conditions.size(); ++i) {
    const ConditionReport& condition = report.conditions[i];
    for (const GateTrial& trial : condition.trials) {
      const auto& failing = condition.newly_failing_seeds;
      if (std::find(failing.begin(), failing.end(), trial.seed) == failing.end()) continue;
      if (left-- <= 0) return;
      WriteBundle(FailuresOf(arguments), plan.conditions[i], arguments.assignments, trial);
      progress->Say(fmt::format("  {}, seed {}: {}; in {}", condition.name, trial.seed,
                                NameOf(trial.outcome), FailuresOf(arguments)));
    }
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
  page::AddTrialsIn(FailuresOf(arguments), plan.plugins, &page);
  page::WritePage((out / "report.html").string(), page);
  progress->Say("a page to look at: " + (out / "report.html").string());
}

int ExitCodeOf(statistics::Verdict verdict) {
  if (verdict == statistics::Verdict::kPass) return app::kExitDone;
  return verdict == statistics::Verdict::kFail ? app::kExitCheckFailed : app::kExitInconclusive;
}

void ShowProgress(const std::vector<ConditionJudge>& judges, app::Progress* progress) {
  int trials = 0, most = 0, known = 0;
  for (const ConditionJudge& judge : judges) {
    trials += judge.trials();
    most += judge.done() ? judge.trials() : judge.max_trials();
    known += judge.done();
  }
  progress->ShowOrSay(
      static_cast<double>(trials) / most,
      fmt::format("{} trials, {} of {} conditions known", trials, known, judges.size()),
      kLogEvery_s);
}

int JudgeAgainstBaseline(const GateArguments& arguments, const GatePlan& plan) {
  const Baseline baseline = LoadBaseline(plan.baseline);
  RequireSamePlan(plan, baseline, plan.baseline);
  system::OutputPlan outputs = OutputsOf(arguments, plan);
  outputs.Reads(plan.baseline).Writes(arguments.figure);
  if (!arguments.out.empty()) {
    outputs.WritesInto(arguments.out, {"summary.json", "junit.xml", "summary.md"})
        .Writes(arguments.out + "/report.html", page::kPageFile)
        .Writes(TrialsOf(arguments), system::kResultFile);
    if (arguments.bundles > 0) outputs.WritesInto(FailuresOf(arguments), {});
  }
  outputs.Require();
  app::Progress progress(arguments.quiet);
  const farm::FarmOptions farm = FarmOf(arguments, &progress);
  std::optional<farm::ResultStore> store;
  if (!arguments.out.empty())
    store.emplace(TrialsIn(TrialsOf(arguments), plan, arguments.assignments, &progress));
  GateOptions options{.at_once = AtOnce(farm)};
  options.on_trial = [&](const auto& judges) { ShowProgress(judges, &progress); };
  GateReport report = RunGate(
      plan, baseline, plan.baseline,
      MakeGateRunner(plan, arguments.assignments, RunOf(farm), store ? &*store : nullptr), options);
  report.build = system::BuildId();
  report.assignments = arguments.assignments;
  Show(ReportOf(report), report, arguments);
  if (!arguments.out.empty()) WriteOut(arguments, plan, report, &progress);
  return ExitCodeOf(report.verdict);
}

// ----------------------------------------------------------------------- how many trials it takes

// Beside the options' own ranges: the rate that is worse must be one, too.
void RequireMargin(const GateArguments& arguments) {
  const double most = arguments.rate - statistics::kLeastProbability;
  if (arguments.margin > most)
    throw ConfigError(fmt::format("--margin = {:g} must be at most {:g} for a --rate of {:g}",
                                  arguments.margin, most, arguments.rate));
}

int PlanSize(const GateArguments& arguments) {
  RequireMargin(arguments);
  system::OutputPlan().Writes(arguments.figure).Require();
  const GateSize size = SizeOf({.no_worse = arguments.rate,
                                .worse = arguments.rate - arguments.margin,
                                .alpha = arguments.alpha,
                                .beta = arguments.beta});
  Show(ReportOf(size), size, arguments);
  return app::kExitDone;
}

// -------------------------------------------------------------------------- conditions to watch

int Design(const GateArguments& arguments) {
  RequireMargin(arguments);
  const farm::Plan plan = farm::LoadPlan(
      arguments.design, {.assignments = arguments.assignments, .plugins = arguments.plugins});
  system::OutputPlan outputs;
  outputs.Reads(arguments.design).Reads(arguments.results).Writes(arguments.figure);
  if (!arguments.out.empty()) outputs.WritesInto(arguments.out, {"gate.yaml", "design.json"});
  outputs.Require();
  const DesignOptions options{.from = arguments.rate,
                              .to = arguments.rate - arguments.margin,
                              .alpha = arguments.alpha,
                              .beta = arguments.beta,
                              .budget_s = arguments.budget_s,
                              .workers = arguments.farm.workers.value_or(app::AvailableCores())};
  const std::vector<Candidate> candidates = CandidatesOf(plan, arguments.results);
  const GateDesign design = DesignGate(candidates, options);
  const report::Report report = ReportOf(design);
  Show(report, design, arguments);
  if (arguments.out.empty()) return app::kExitDone;
  const fs::path out(arguments.out);
  system::WriteWhole(out / "gate.yaml",
                     GateYaml(design, candidates, "gate.baseline.yaml", arguments.out));
  system::WriteWhole(out / "design.json", report::JsonText(report::Document(report, design)));
  if (!arguments.quiet)
    fmt::print(stderr,
               "gate.yaml and design.json in {0}; its baseline is next:\n"
               "turbidock gate {0}/gate.yaml --update\n",
               system::Printable(arguments.out));
  return app::kExitDone;
}

int Gate(const GateArguments& arguments) {
  if (!arguments.design.empty()) return Design(arguments);
  if (arguments.plan_size) return PlanSize(arguments);
  if (arguments.plan.empty()) throw ConfigError("gate: which gate? Give its file");
  GatePlan plan = LoadGatePlan(arguments.plan, arguments.plugins);
  if (!arguments.baseline.empty()) plan.baseline = arguments.baseline;
  try {
    return arguments.update ? UpdateBaseline(arguments, plan)
                            : JudgeAgainstBaseline(arguments, plan);
  } catch (const farm::Stopped&) {
    if (!arguments.quiet && (arguments.update || !arguments.out.empty()))
      std::fputs("stopped; the same command goes on\n", stderr);
    return app::kExitInconclusive;  // main makes it the signal's
  }
}

// Questions that need no gate.
struct QuestionOptions {
  app::Option design, plan_size;
  std::vector<app::Option> numbers;
};
QuestionOptions AddQuestions(app::Subcommand* gate, GateArguments* arguments) {
  const char* designs =
      "Which conditions to watch (no gate needed; --rate, --margin, --alpha, --beta)";
  app::Option design =
      gate->Add("--design PLAN", arguments->design,
                "Choose conditions, margins and numbers of trials among the cells of this plan;\n"
                "--out: gate.yaml, design.json")
          .Group(designs);
  app::Option results =
      gate->Add("--results FILE", arguments->results, "A batch of that plan").Group(designs);
  app::Option budget = gate->Add("--budget", arguments->budget_s,
                                 "Seconds that a build without change may take, by --workers")
                           .Between(0.1, 1e7)
                           .Group(designs);
  const char* group = "How many trials it takes (no gate needed)";
  app::Option plan_size = gate->Flag("--plan-size", arguments->plan_size,
                                     "Print expected and most trials for these rates")
                              .Group(group);
  constexpr double kLeast = statistics::kLeastProbability;
  const auto add = [&](const char* name, double& target, const char* doc, double low, double high) {
    return gate->Add(name, target, doc).Between(low, high).Group(group);
  };
  for (app::Option option : {results, budget}) option.Needs(design);
  design.Needs(results);
  plan_size.Excludes(design);
  return {
      design,
      plan_size,
      {add("--rate", arguments->rate, "Success rate that is no worse", 2 * kLeast, 1 - kLeast),
       add("--margin", arguments->margin, "Loss of success rate that matters", kLeast,
           1 - 2 * kLeast),
       add("--alpha", arguments->alpha, "Chance of a false alarm", kLeast, 1 - kLeast),
       add("--beta", arguments->beta, "Chance to miss a loss of the margin", kLeast, 1 - kLeast)}};
}

}  // namespace

void AddGate(app::CommandLine& line) {
  auto [gate, arguments] =
      line.Add("gate", "Compare docking with a committed baseline: pass, fail or neither", &Gate);
  arguments.plugins = line.plugins();
  gate.Footer(
      "Exit codes: 0 pass, 1 fail, 2 bad input, 3 inconclusive: the trials allowed are spent,\n"
      "4 a trial could not be run.");
  const app::Option plan = gate.Add("gate", arguments.plan, "The gate's YAML file");
  app::Option baseline =
      gate.Add("--baseline", arguments.baseline, "Another baseline file than the gate's");
  const app::Option out =
      gate.Add("--out", arguments.out,
               "Folder for report.html, summary.json, junit.xml, summary.md, failures/");
  const app::Option figure = gate.AddFigure(arguments.figure, "Draw what the report shows");
  const app::FarmArguments::Options farm =
      arguments.farm.AddTo(&gate, "Processes that run trials", app::AvailableCores());
  const app::Option set = gate.AddSet(
      arguments.assignments, "Set one scenario key in every condition, as if the build had it so");
  app::Option bundles = gate.Add("--bundles", arguments.bundles,
                                 "Trials with video of newly failing seeds in failures/, at most")
                            .NotNegative();
  app::Option update = gate.Flag("--update", arguments.update,
                                 "Measure the baseline anew, write it, and say what changed");
  const app::Option json =
      gate.Flag("--json", arguments.json, "Print the report as JSON on stdout: summary.json");
  gate.AddQuiet(arguments.quiet);
  auto [design, plan_size, numbers] = AddQuestions(&gate, &arguments);

  // What goes with a gate's file, with a plan of candidates, with rates alone.
  for (app::Option option : {baseline, bundles, update}) option.Needs(plan);
  for (app::Option option : {design, plan_size}) option.Excludes(plan);
  for (app::Option& option : numbers) option.Excludes(plan);
  plan_size.Excludes(set).Excludes(out).Excludes(farm.workers).Excludes(farm.slurm);
  design.Excludes(farm.slurm);  // it runs nothing
  for (const app::Option& option : {out, figure, set, bundles, json}) update.Excludes(option);
}

}  // namespace turbidock::gate
