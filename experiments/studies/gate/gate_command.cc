#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
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
#include "experiments/studies/gate/real_trials.h"
#include "experiments/studies/run/shown_trial.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

namespace fs = std::filesystem;

struct GateArguments {
  trial::Plugins plugins;
  std::string gate, baseline, out, real;
  std::vector<std::string> assignments, beside;
  std::string gains;
  command::JobArguments jobs;
  int bundles = 5;
  bool update = false, json = false, quiet = false, anew = false;

  std::string failures() const { return out + "/failures"; }
};

// The file that keeps the trials until there is a baseline or, of --out, for good; else none.
std::string TrialsFile(const GateArguments& arguments, const Gate& gate) {
  if (arguments.update) return gate.settings.baseline + ".trials.db";
  return arguments.out.empty() ? "" : arguments.out + "/trials.db";
}

// Failures of an earlier run.
void RemoveBundles(const GateArguments& arguments) {
  std::error_code none;
  std::vector<fs::path> bundles;
  for (const auto& entry : fs::directory_iterator(arguments.failures(), none))
    if (fs::exists(entry.path() / "resolved.yaml", none)) bundles.push_back(entry.path());
  for (const fs::path& bundle : bundles) fs::remove_all(bundle);
}

// Runs it in worker processes and keeps its trials in a file, unless its name is empty.
void RunTrials(const GateArguments& arguments, const Gate& gate, const system::OutputPlan& outputs,
               GateRun* run, command::Progress* progress) {
  const auto say = [progress](const std::string& text) { progress->Say("  " + text); };
  const std::string beside = arguments.out.empty() ? "" : arguments.out + "/trials";
  const batch::RunOptions options{.jobs = arguments.jobs.For(beside, say),
                                  .time_limit_s = gate.plan.settings().trial_time_limit_s,
                                  .stop_requested = command::CatchStopSignals()};
  for (const std::string& remark : gate.plan.remarks()) say(remark);
  for (const std::string& remark : run->Remarks()) say(remark);
  std::optional<batch::ResultStore> store;
  if (const std::string file = TrialsFile(arguments, gate); !file.empty()) {
    store.emplace(OpenTrials(file, gate, arguments.anew, options.jobs, say));
    if (!arguments.update) {
      outputs.RemoveOld();
      RemoveBundles(arguments);
    }
    if (const auto there = std::ssize(store->Done()); there > 0)
      say(fmt::format("{} trials are in {} already", there, file));
  }
  run->Run(options, store ? &*store : nullptr, [progress](const GateProgress& now) {
    progress->ShowDone(now.done, now.least, now.most, "trials", /*every_s=*/10);
  });
}

// Whose baseline it is may be said beside the gate's file; the rest would be in neither file.
void RequireOnlyPlugins(const GateArguments& arguments) {
  constexpr std::array<std::string_view, 3> kKeys = {"control.use", "estimator.use",
                                                     "estimator.pose_source"};
  for (const std::string& each : arguments.assignments)
    if (std::ranges::count(kKeys, each.substr(0, each.find('='))) == 0)
      throw ConfigError(fmt::format("--set {}: with --update it must be one of {}; {} has the rest",
                                    each, fmt::join(kKeys, ", "), arguments.gate));
}

int UpdateBaseline(const GateArguments& arguments, const Gate& gate, system::OutputPlan outputs) {
  RequireOnlyPlugins(arguments);
  const std::string& baseline = gate.settings.baseline;
  const std::string trials = TrialsFile(arguments, gate);
  outputs.Writes(baseline, kBaselineFile).Writes(trials, system::kResultFile).Require();
  command::Progress progress(arguments.quiet);
  GateRun run(gate);
  RunTrials(arguments, gate, outputs, &run, &progress);
  const Baseline now = run.Measured();
  [[maybe_unused]] const GateRun refuses(gate, now);  // what no build could be compared with
  system::WriteWhole(baseline, BaselineText(now));
  fs::remove(trials);
  for (const BaselineCondition& c : now.conditions)
    fmt::print("{}: {} of {} succeed\n", c.name, c.successes, c.trials);
  progress.Say("written to " + baseline + ", a line a trial: a diff shows what changed");
  return command::kExitDone;
}

// What it takes to look into a seed that was lost: it runs once more, with all files and, where
// there are cameras, a video, into failures/CONDITION_SEED/.
void WriteBundle(const GateArguments& arguments, const Gate& gate,
                 const std::vector<batch::StoredTrial>& trials, const batch::Flip& flip,
                 command::Progress* progress) {
  const std::string bundle = arguments.failures() + "/" + flip.link;
  const trial::Scenario scenario = gate.plan.ScenarioOf(gate.plan.Trial(*flip.trial_b));
  const bool films = scenario.pose_source == trial::PoseSource::kCameras;
  const trial::TrialResult again =
      run::RunShownTrial(scenario, {.out = bundle, .video = films, .quiet = true});
  if (command::StopSignal() != 0) throw batch::Stopped();
  const std::string& digest =
      std::ranges::find(trials, *flip.trial_b, &batch::StoredTrial::trial)->record.digest;
  if (again.digest != digest)
    throw SimulatorFault(fmt::format("{}: the trial does not repeat: digest {}, in the gate {}",
                                     bundle, again.digest, digest));
  progress->Say(fmt::format("  {}, seed {}: {}; in {}", flip.group, flip.seed, flip.why, bundle));
}

// Of as many seeds as asked for; what failed the gate at once comes first.
void WriteBundles(const GateArguments& arguments, const Gate& gate, const GateRun& run,
                  const GateReport& report, command::Progress* progress) {
  int left = arguments.bundles;
  for (const batch::FlipKind kind : {batch::FlipKind::kForbidden, batch::FlipKind::kLost})
    for (size_t i = 0; i < report.conditions.size(); ++i)
      for (const batch::Flip& flip : report.conditions[i].flips)
        if (flip.change == kind && left-- > 0)
          WriteBundle(arguments, gate, run.TrialsOf(i), flip, progress);
}

// What a seed that changed opens in the page: how to run it, unless a bundle takes its place.
report::Json LinksOf(const GateArguments& arguments, const GateReport& report) {
  report::Json links = report::Json::object();
  for (const ConditionReport& condition : report.conditions)
    for (const batch::Flip& flip : condition.flips)
      links[flip.link] = page::Link{
          .title = fmt::format("{}, seed {}", flip.group, flip.seed),
          .trials = {{.title = NameOf(flip.change),
                      .outcome = flip.change == batch::FlipKind::kGained
                                     ? NameOf(trial::Outcome::kSuccess)
                                     : flip.why,
                      .reason = "",
                      .note = "Its traces are not kept: the gate ran it without (--bundles).",
                      .commands = {
                          {"The trial again, with film and all its files",
                           fmt::format("{} replay {} {} --out out/{}", arguments.plugins.program(),
                                       system::ShellWord(arguments.out + "/trials.db"),
                                       *flip.trial_b, flip.link)}}}}};
  return links;
}

// The folder of --out, once the verdict is known.
void WriteOut(const GateArguments& arguments, const Gate& gate, const GateRun& run,
              const GateReport& report, const report::Report& shown, report::Json document,
              command::Progress* progress) {
  const fs::path out(arguments.out);
  document["links"] = LinksOf(arguments, report);
  system::WriteWhole(out / "summary.json", report::JsonText(document));
  system::WriteWhole(out / "junit.xml", Junit(report));
  system::WriteWhole(out / "summary.md", report::Markdown(shown));
  WriteBundles(arguments, gate, run, report, progress);
  page::Page page = page::ReportPage(document, arguments.out);
  page::AddTrialsIn(arguments.failures(), arguments.plugins, &page);
  page::WritePage((out / "report.html").string(), page);
  progress->Say("report.html, summary.json, junit.xml and summary.md in " + arguments.out);
}

int JudgeAgainstBaseline(const GateArguments& arguments, const Gate& gate,
                         system::OutputPlan outputs) {
  const Baseline baseline = LoadBaseline(gate.settings.baseline);
  GateRun run(gate, baseline);
  outputs.Reads(gate.settings.baseline).Reads(arguments.real);
  std::vector<statistics::Count> real;
  if (!arguments.real.empty()) real = LoadRealTrials(arguments.real, gate);
  std::vector<std::pair<std::string, GateReport>> beside;
  for (const std::string& folder : arguments.beside) {
    beside.emplace_back(folder, ReportOfFile(folder + "/trials.db", gate, baseline));
    outputs.Reads(folder + "/trials.db");
  }
  if (!arguments.out.empty()) {
    outputs.WritesInto(arguments.out, {"summary.json", "junit.xml", "summary.md"})
        .Writes(arguments.out + "/report.html", page::kPageFile)
        .Writes(TrialsFile(arguments, gate), system::kResultFile);
    if (arguments.bundles > 0) outputs.WritesInto(arguments.failures(), {});
  }
  outputs.Require();
  if (!arguments.out.empty()) system::MakeFolder(arguments.out);
  command::Progress progress(arguments.quiet);
  RunTrials(arguments, gate, outputs, &run, &progress);
  const GateReport report = run.Report();
  report::Report shown = ReportOf(report, beside);
  report::Json result = report;
  if (!arguments.real.empty()) {
    const RealTrials trials = WithReal(real, report);
    shown.sections.push_back(RealTrialSection(trials, report));
    result["real"] = RealTrialJson(trials, report);
  }
  command::PrintReport(shown, result, arguments.json);
  if (!arguments.out.empty())
    WriteOut(arguments, gate, run, report, shown, report::Document(shown, result), &progress);
  if (report.verdict == statistics::Verdict::kPass) return command::kExitDone;
  return report.verdict == statistics::Verdict::kFail ? command::kExitCheckFailed
                                                      : command::kExitInconclusive;
}

int RunGate(const GateArguments& arguments) {
  Gate gate = LoadGate(arguments.gate, arguments.plugins,
                       trial::GivenBy(arguments.gains, arguments.assignments));
  if (!arguments.baseline.empty()) gate.settings.baseline = arguments.baseline;
  system::OutputPlan outputs;  // with what the gate reads
  outputs.Reads(arguments.gate).Reads(gate.plan.files());
  try {
    return arguments.update ? UpdateBaseline(arguments, gate, outputs)
                            : JudgeAgainstBaseline(arguments, gate, outputs);
  } catch (const batch::Stopped&) {
    const std::string trials = TrialsFile(arguments, gate);
    command::Progress(arguments.quiet)
        .Say(trials.empty()
                 ? "stopped: without --out no trial is kept"
                 : "stopped: the trials so far are in " + trials + "; the same command goes on");
    return command::kExitInconclusive;  // main makes it the signal's
  }
}

}  // namespace

void AddGate(command::CommandLine& line) {
  auto [gate, arguments] = line.Add(
      "gate", "Compare docking with a committed baseline: pass, fail or neither", &RunGate);
  arguments.plugins = line.plugins();
  gate.Footer(
      "Exit codes: 0 pass, 1 fail, 2 bad input, 3 inconclusive: the trials allowed are spent,\n"
      "4 a trial could not be run.");
  gate.Add("gate", arguments.gate, "A gate's YAML file or the name of a bundled one").Required();
  gate.Add("--baseline", arguments.baseline, "Another baseline file than the gate's");
  const command::Option out =
      gate.Add("--out", arguments.out,
               "Folder for report.html, summary.json, junit.xml, summary.md, failures/");
  const command::Option beside =
      gate.Add("--beside FOLDER,...", arguments.beside,
               "Folders of --out by other builds: show them side by side");
  const command::Option real = gate.Add(
      "--real FILE.csv", arguments.real,
      "Real trials (condition,success: a row a trial): what rate to expect of the vehicle");
  arguments.jobs.AddTo(&gate, "Processes that run trials");
  gate.AddSet(arguments.assignments,
              "Set one scenario key in every condition, as if the build had it so");
  const command::Option gains = gate.AddGains(arguments.gains);
  const command::Option bundles =
      gate.Add("--bundles", arguments.bundles,
               "Trials with video of newly failing seeds in failures/, at most")
          .NotNegative();
  command::Option update =
      gate.Flag("--update", arguments.update, "Measure the baseline anew and write it");
  const command::Option json =
      gate.Flag("--json", arguments.json, "Print the report as JSON on stdout");
  gate.AddAnew(arguments.anew);
  gate.AddQuiet(arguments.quiet);
  for (const command::Option& option : {out, beside, real, gains, bundles, json})
    update.Excludes(option);
}

}  // namespace turbidock::gate
