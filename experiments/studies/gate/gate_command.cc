#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/farm_arguments.h"
#include "experiments/app/plan_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/page/study_page.h"
#include "experiments/report/json.h"
#include "experiments/report/table.h"
#include "experiments/studies/gate/error_rates.h"
#include "experiments/studies/gate/gate.h"
#include "experiments/studies/gate/gate_design.h"
#include "experiments/studies/gate/gate_figure.h"
#include "experiments/studies/gate/gate_output.h"
#include "experiments/studies/gate/trial_runner.h"
#include "experiments/studies/run/shown_trial.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

namespace fs = std::filesystem;
using report::Fixed;
using report::Json;

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
  int64_t simulate = 0;
  double rate = 0.95, margin = 0.1, alpha = 0.05, beta = 0.05;
  int max_trials = 0;  // 0: as many as it takes
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
  for (const std::string& line : DescribeChange(before, now)) progress.Say(line);
  progress.Say("written to " + plan.baseline);
  return app::kExitDone;
}

// A name that is a good file name everywhere.
std::string FileName(const std::string& name) {
  std::string out;
  for (const char c : name) out += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return out;
}

// What it takes to look into a trial: it runs once more, with all files and, where there are
// cameras, a video, into FOLDER/CONDITION_SEED/; replay.txt says how to run it again.
void WriteBundle(const std::string& folder, const GateCondition& condition,
                 const std::vector<std::string>& assignments, const GateTrial& trial) {
  const std::string bundle = fmt::format("{}/{}_{}", folder, FileName(condition.name), trial.seed);
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

int ExitCodeOf(statistics::Verdict verdict) {
  if (verdict == statistics::Verdict::kPass) return app::kExitDone;
  return verdict == statistics::Verdict::kFail ? app::kExitCheckFailed : app::kExitInconclusive;
}

int JudgeAgainstBaseline(const GateArguments& arguments, const GatePlan& plan) {
  const Baseline baseline = LoadBaseline(plan.baseline);
  RequireSamePlan(plan, baseline, plan.baseline);
  if (!arguments.figure.empty()) media::RequireFigurePath(arguments.figure);
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
  options.on_trial = [&](const std::vector<ConditionJudge>& judges) {
    int trials = 0, most = 0, known = 0;
    for (const ConditionJudge& judge : judges) {
      trials += judge.trials();
      most += judge.done() ? judge.trials() : judge.max_trials();
      known += judge.done();
    }
    progress.ShowOrSay(
        static_cast<double>(trials) / most,
        fmt::format("{} trials, {} of {} conditions known", trials, known, judges.size()),
        kLogEvery_s);
  };
  GateReport report = RunGate(
      plan, baseline, plan.baseline,
      MakeGateRunner(plan, arguments.assignments, RunOf(farm), store ? &*store : nullptr), options);
  report.build = system::BuildId();
  report.assignments = arguments.assignments;
  progress.Say(GateTable(report));
  if (arguments.json) std::fputs(GateJson(report).c_str(), stdout);
  if (!arguments.figure.empty()) media::WriteFigure(arguments.figure, GateFigure(report));
  if (!arguments.out.empty()) {
    const fs::path out(arguments.out);
    system::WriteWhole(out / "summary.json", GateJson(report));
    system::WriteWhole(out / "junit.xml", GateJunit(report));
    system::WriteWhole(out / "summary.md", GateMarkdown(report));
    progress.Say("summary.json, junit.xml and summary.md in " + arguments.out);
    WriteBundles(arguments, plan, report, &progress);
    page::WritePage((out / "report.html").string(),
                    page::StudyFolderPage(arguments.out, plan.plugins));
    progress.Say("a page to look at: " + (out / "report.html").string());
  }
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

constexpr uint64_t kSimulationSeed = 1;

int PlanSize(const GateArguments& arguments) {
  RequireMargin(arguments);
  if (!arguments.figure.empty()) media::RequireFigurePath(arguments.figure);
  system::OutputPlan outputs;
  outputs.Writes(arguments.figure);
  if (!arguments.out.empty()) outputs.WritesInto(arguments.out, {"error_rates.png"});
  outputs.Require();

  statistics::RateTestDesign design{.no_worse = arguments.rate,
                                    .worse = arguments.rate - arguments.margin,
                                    .alpha = arguments.alpha,
                                    .beta = arguments.beta,
                                    .max_trials = arguments.max_trials};
  // The first to know that no test is short enough.
  const statistics::FixedTest fixed = statistics::FixedSampleTest(design);
  if (design.max_trials == 0)
    design.max_trials = statistics::TrialsToDecide(design, /*inconclusive=*/0.01);
  const statistics::RateTest test(design);
  const int64_t sequences = arguments.simulate > 0 ? arguments.simulate : 10000;
  auto exact = Json::array(), counted = Json::array();
  report::Table expected(
      {"<known old rate, exact", "new rate", "fail", "pass", "inconclusive", "trials", "fewer by"});
  for (const double p : {design.no_worse, (design.no_worse + design.worse) / 2, design.worse}) {
    const statistics::RateTest::Characteristic c = test.At(p);
    const double saving = 1 - c.expected_trials / fixed.trials;
    exact.push_back({{"new_rate", p},
                     {"fail", c.p_fail},
                     {"pass", c.p_pass},
                     {"inconclusive", c.p_inconclusive},
                     {"expected_trials", c.expected_trials},
                     {"saving", saving}});
    expected.Row({"", fmt::format("{:.4g}", p), Fixed(c.p_fail, 4), Fixed(c.p_pass, 4),
                  Fixed(c.p_inconclusive, 4), Fixed(c.expected_trials, 1),
                  Fixed(100 * saving, 0) + " %"});
  }
  report::Table simulated({fmt::format("<{} sequences", sequences), "new rate", "fail", "pass",
                           "inconclusive", "trials"});
  for (const ErrorRateSetting& setting : StatedSettings(design)) {
    const ErrorRates r = SimulateSequences(setting, design, sequences, kSimulationSeed);
    const double inconclusive =
        static_cast<double>(sequences - r.failed - r.passed) / static_cast<double>(sequences);
    counted.push_back({{"setting", setting.coupling},
                       {"old_rate", setting.old_rate},
                       {"new_rate", setting.new_rate},
                       {"sequences", sequences},
                       {"fail", r.fail_rate()},
                       {"pass", r.pass_rate()},
                       {"inconclusive", inconclusive},
                       {"mean_trials", r.mean_trials}});
    simulated.Row({NameOf(setting.coupling), fmt::format("{:.4g}", setting.new_rate),
                   Fixed(r.fail_rate(), 4), Fixed(r.pass_rate(), 4), Fixed(inconclusive, 4),
                   Fixed(r.mean_trials, 1)});
  }
  if (arguments.json)
    fmt::print("{}", report::JsonText({{"no_worse", design.no_worse},
                                       {"worse", design.worse},
                                       {"alpha", design.alpha},
                                       {"beta", design.beta},
                                       {"max_trials", design.max_trials},
                                       {"fixed_size_trials", fixed.trials},
                                       {"exact", exact},
                                       {"simulated", counted}}));
  else
    fmt::print(
        "success rate {:g} against {:g}, alpha {:g}, beta {:g}, at most {} trials\n"
        "a test of fixed size takes {} trials and fails when {} or fewer succeed\n\n{}\n{}",
        design.no_worse, design.worse, design.alpha, design.beta, design.max_trials, fixed.trials,
        fixed.fail_at_most, expected.Text(), simulated.Text());
  std::vector<std::string> figures;
  if (!arguments.out.empty()) figures.push_back(arguments.out + "/error_rates.png");
  if (!arguments.figure.empty()) figures.push_back(arguments.figure);
  for (const std::string& path : figures) {
    const double deviations = WriteErrorRateFigure(path, design, sequences, kSimulationSeed);
    std::fprintf(
        stderr,
        "%s: counted rates differ from the exact ones by %.1f standard deviations at most\n",
        system::Printable(path).c_str(), deviations);
  }
  return app::kExitDone;
}

// -------------------------------------------------------------------------- conditions to watch

int Design(const GateArguments& arguments) {
  RequireMargin(arguments);
  if (!arguments.figure.empty()) media::RequireFigurePath(arguments.figure);
  const farm::Plan plan = farm::LoadPlan(
      arguments.design, {.assignments = arguments.assignments, .plugins = arguments.plugins});
  system::OutputPlan outputs;
  outputs.Reads(arguments.design).Reads(arguments.results).Writes(arguments.figure);
  if (!arguments.out.empty())
    outputs.WritesInto(arguments.out, {"gate.yaml", "design.json", "design.png"});
  outputs.Require();
  DesignOptions options{.from = arguments.rate,
                        .to = arguments.rate - arguments.margin,
                        .alpha = arguments.alpha,
                        .beta = arguments.beta,
                        .budget_s = arguments.budget_s,
                        .workers = arguments.farm.workers.value_or(app::AvailableCores())};
  if (arguments.max_trials > 0) options.most_trials = arguments.max_trials;
  const std::vector<Candidate> candidates = CandidatesOf(plan, arguments.results);
  const GateDesign design = DesignGate(candidates, options);
  fmt::print("{}", arguments.json ? DesignJson(design, options) : DesignTable(design, options));
  if (!arguments.figure.empty()) WriteDesignFigure(arguments.figure, design, options);
  if (arguments.out.empty()) return app::kExitDone;
  const fs::path out(arguments.out);
  system::WriteWhole(out / "gate.yaml",
                     GateYaml(design, candidates, options, "gate.baseline.yaml", arguments.out));
  system::WriteWhole(out / "design.json", DesignJson(design, options));
  WriteDesignFigure((out / "design.png").string(), design, options);
  if (!arguments.quiet)
    fmt::print(stderr,
               "gate.yaml, design.json and design.png in {0}; its baseline is next:\n"
               "turbidock gate {0}/gate.yaml --update\n",
               system::Printable(arguments.out));
  return app::kExitDone;
}

int Gate(const GateArguments& arguments) {
  if (!arguments.design.empty()) return Design(arguments);
  if (arguments.plan_size || arguments.simulate > 0) return PlanSize(arguments);
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
  const app::Option figure = gate.Add(
      "--figure FILE", arguments.figure,
      "Draw the tests' way to the verdict: .png, .svg or .pdf; with --plan-size error rates");
  const app::FarmArguments::Options farm =
      arguments.farm.AddTo(&gate, "Processes that run trials", app::AvailableCores());
  const app::Option set = gate.AddSet(
      arguments.assignments, "Set one scenario key in every condition, as if the build had it so");
  app::Option bundles = gate.Add("--bundles", arguments.bundles,
                                 "Trials with video of newly failing seeds in failures/, at most")
                            .NotNegative();
  app::Option update = gate.Flag("--update", arguments.update,
                                 "Measure the baseline anew, write it, and say what changed");
  const app::Option json = gate.Flag("--json", arguments.json, "Print summary.json on stdout");
  gate.AddQuiet(arguments.quiet);
  const char* designs =
      "Which conditions to watch (no gate needed; --rate, --margin, --alpha, --beta)";
  app::Option design =
      gate.Add("--design PLAN", arguments.design,
               "Choose conditions, margins and numbers of trials among the cells of this plan;\n"
               "--out: gate.yaml, design.json, design.png")
          .Group(designs);
  app::Option results =
      gate.Add("--results FILE", arguments.results, "A batch of that plan").Group(designs);
  app::Option budget = gate.Add("--budget", arguments.budget_s,
                                "Seconds that a build without change may take, by --workers")
                           .Between(0.1, 1e7)
                           .Group(designs);
  const char* group = "How many trials it takes (no gate needed)";
  app::Option plan_size = gate.Flag("--plan-size", arguments.plan_size,
                                    "Print expected and most trials for these rates")
                              .Group(group);
  app::Option simulate =
      gate.Add("--simulate", arguments.simulate,
               "The same, with this many simulated sequences a setting; --out: error_rates.png")
          .Between(1, 100000000)
          .Group(group);
  constexpr double kLeast = statistics::kLeastProbability;
  app::Option rate = gate.Add("--rate", arguments.rate, "Success rate that is no worse")
                         .Between(2 * kLeast, 1 - kLeast)
                         .Group(group);
  app::Option margin = gate.Add("--margin", arguments.margin, "Loss of success rate that matters")
                           .Between(kLeast, 1 - 2 * kLeast)
                           .Group(group);
  app::Option alpha = gate.Add("--alpha", arguments.alpha, "Chance of a false alarm")
                          .Between(kLeast, 1 - kLeast)
                          .Group(group);
  app::Option beta = gate.Add("--beta", arguments.beta, "Chance to miss a loss of the margin")
                         .Between(kLeast, 1 - kLeast)
                         .Group(group);
  app::Option max_trials = gate.Add("--max-trials", arguments.max_trials,
                                    "Trials at most; else as many as leave 1 % undecided")
                               .Between(1, 10000)
                               .Group(group);

  // What goes with a gate's file, with a plan of candidates, with rates alone.
  for (app::Option option : {baseline, bundles, update}) option.Needs(plan);
  for (app::Option option : {design, plan_size, simulate, rate, margin, alpha, beta, max_trials})
    option.Excludes(plan);
  for (app::Option option : {results, budget}) option.Needs(design);
  design.Needs(results);
  for (app::Option option : {plan_size, simulate})
    option.Excludes(design).Excludes(set).Excludes(farm.workers).Excludes(farm.slurm);
  design.Excludes(farm.slurm);  // it flies nothing
  for (const app::Option& option : {out, figure, set, bundles, json}) update.Excludes(option);
}

}  // namespace turbidock::gate
