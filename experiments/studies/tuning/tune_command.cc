#include <fmt/format.h>

#include <string>

#include "experiments/command/command_line.h"
#include "experiments/command/job_arguments.h"
#include "experiments/command/progress.h"
#include "experiments/command/report_output.h"
#include "experiments/report/report_json.h"
#include "experiments/studies/tuning/tuner.h"
#include "experiments/system/output_path.h"

namespace turbidock::tuning {
namespace {

struct TuneArguments {
  trial::Plugins plugins;
  std::string study;
  command::JobArguments jobs;
  command::ReportOutput output;
  bool quiet = false, anew = false;
};

int Tune(const TuneArguments& arguments) {
  const Study study = LoadStudy(arguments.study, arguments.plugins);
  const std::string& out = *arguments.output.out;
  const std::string file = out + "/evaluations.sqlite";
  system::OutputPlan outputs;
  outputs.Reads(arguments.study)
      .Reads(study.plan().files())
      .Writes(file, system::kResultFile)
      .Writes(out + "/gains.yaml", kGainsFile);
  arguments.output.Plan("tuning", &outputs);
  outputs.Require();
  system::MakeFolder(out);
  command::Progress progress(arguments.quiet);
  progress.Say(fmt::format("{}: {} gains, study {}", study.plan().title(), study.start().size(),
                           study.hash()));
  for (const std::string& remark : study.plan().remarks()) progress.Say("  " + remark);
  TuningOptions options;
  options.jobs = arguments.jobs.For(out + "/trials",
                                    [&](const std::string& text) { progress.Say("  " + text); });
  options.anew = arguments.anew;
  options.stop_requested = command::CatchStopSignals();
  options.on_progress = [&](const std::string& what, double share) {
    progress.ShowOrSay(share, what, /*every_s=*/20);
  };
  options.on_result = [&](const TuningResult& so_far) {
    if (so_far.generations.empty()) outputs.RemoveOld();
    const report::Report report = ReportOf(study, so_far);
    const report::Json json = TuningJson(study, so_far);
    if (so_far.finished) {
      system::WriteWhole(out + "/gains.yaml", GainsYaml(study, so_far));
      arguments.output.Write(report, json);
    } else {
      system::WriteWhole(out + "/report.json", report::JsonText(report::Document(report, json)));
    }
    if (!so_far.generations.empty() && !so_far.finished) {
      const GenerationRecord& g = so_far.generations.back();
      progress.Say(fmt::format(
          "  {:3}: best {:8.2f}, incumbent on the same new seeds {:8.2f} ({:.0f} % succeed){}",
          g.generation, g.best, g.incumbent, 100 * g.incumbent_success,
          g.replaced ? ", replaced" : ""));
    }
  };
  try {
    const TuningResult result = Tune(study, file, options);
    progress.Say(fmt::format("{} trials, {} of them run now; gains.yaml, report.html in {}",
                             result.trials, result.trials_run, out));
  } catch (const batch::Stopped&) {  // main makes the signal's code of it
    progress.Say(
        fmt::format("stopped: the trials so far are in {}; the same command goes on", file));
  }
  return command::kExitDone;
}

}  // namespace

void AddTune(command::CommandLine& line) {
  auto [tune, arguments] =
      line.Add<TuneArguments>("tune", "Tune controller gains over closed-loop trials", &Tune);
  arguments.plugins = line.plugins();
  tune.Add("study", arguments.study,
           "YAML file or the name of a bundled study (see `turbidock list studies`)")
      .Required();
  arguments.output
      .AddTo(&tune,
             "Folder for gains.yaml, the report and every evaluation; an interrupted study in it "
             "goes on")
      .Required();
  arguments.jobs.AddTo(&tune, "Processes that run trials");
  tune.AddAnew(arguments.anew);
  tune.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::tuning
