#include <fmt/format.h>

#include <string>

#include "experiments/app/commands.h"
#include "experiments/app/job_arguments.h"
#include "experiments/app/plan_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/app/report_output.h"
#include "experiments/report/report_json.h"
#include "experiments/studies/tuning/tuner.h"
#include "experiments/system/output_path.h"

namespace turbidock::tuning {
namespace {

constexpr double kLogEvery_s = 20;

struct TuneArguments {
  trial::Plugins plugins;
  std::string study;
  app::JobArguments jobs;
  app::ReportOutput output;
  bool quiet = false;
};

std::string Summary(const GenerationRecord& g) {
  return fmt::format(
      "  {:3}: best {:8.2f}, median {:8.2f}, incumbent {:8.2f} ({:.0f} % docked), {} of {} given "
      "up, {} trials{}",
      g.generation, g.best, g.median, g.incumbent, 100 * g.incumbent_success, g.given_up,
      g.candidates, g.trials, g.replaced ? ", replaced" : "");
}

int Tune(const TuneArguments& arguments) {
  const Study study = LoadStudy(arguments.study, arguments.plugins);
  const std::string& out = *arguments.output.out;
  const std::string file = out + "/evaluations.sqlite";
  system::OutputPlan outputs;
  outputs.Reads(arguments.study)
      .Reads(study.TrialsOf(0, 1).files())
      .Writes(file, system::kResultFile)
      .Writes(out + "/gains.yaml", kGainsFile);
  arguments.output.Plan("tuning", &outputs);
  outputs.Require();
  app::Progress progress(arguments.quiet);
  const StudySettings& settings = study.settings();
  progress.Say(fmt::format("{}: {} gains, {} generations of {}, study {}", settings.description,
                           settings.gains.size(), settings.optimiser.generations,
                           settings.optimiser.population, study.hash()));
  TuningOptions options;
  options.jobs = arguments.jobs.For(out + "/trials",
                                    [&](const std::string& text) { progress.Say("  " + text); });
  options.stop_requested = app::CatchStopSignals();
  options.on_progress = [&](const std::string& phase, double share, int64_t trials) {
    progress.ShowOrSay(share, fmt::format("{}, {} trials", phase, trials), kLogEvery_s);
  };
  size_t said = 0;
  options.on_result = [&](const TuningResult& so_far) {
    const report::Report report = ReportOf(study, so_far);
    const report::Json json = TuningJson(study, so_far);
    if (so_far.finished) {
      system::WriteWhole(out + "/gains.yaml", GainsYaml(study, so_far));
      arguments.output.Write(report, json);
    } else {
      system::WriteWhole(out + "/report.json", report::JsonText(report::Document(report, json)));
    }
    for (; said < so_far.generations.size(); ++said)
      progress.Say(Summary(so_far.generations[said]));
  };
  try {
    const TuningResult result = Tune(study, file, options);
    const double busy = result.wall_time_s * options.jobs.capacity();
    progress.Say(
        fmt::format("{} trials, {} of them run now in {:.0f} s, workers busy {:.1f} % of the time; "
                    "gains.yaml, report.md, report.json, report.html, tuning.png in {}",
                    result.trials, result.trials_run, result.wall_time_s,
                    busy > 0 ? 100 * result.worker_time_s / busy : 0, out));
  } catch (const Stopped&) {  // main makes the signal's code of it
    progress.Say(
        fmt::format("stopped: the trials so far are in {}; the same command goes on", file));
  }
  return app::kExitDone;
}

}  // namespace

void AddTune(app::CommandLine& line) {
  auto [tune, arguments] =
      line.Add<TuneArguments>("tune", "Tune controller gains over closed-loop trials", &Tune);
  arguments.plugins = line.plugins();
  tune.Add("study", arguments.study,
           "YAML file or the name of a bundled study (see `turbidock list studies`)")
      .Required();
  arguments.output
      .AddTo(&tune,
             "Folder for gains.yaml, the report and every evaluation; one that holds a part of the "
             "study is gone on with")
      .Required();
  arguments.jobs.AddTo(&tune, "Processes that run trials", app::AvailableCores());
  tune.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::tuning
