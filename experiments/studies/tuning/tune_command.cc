#include <fmt/format.h>

#include <cstdio>
#include <string>

#include "experiments/app/commands.h"
#include "experiments/app/farm_arguments.h"
#include "experiments/app/plan_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/page/study_page.h"
#include "experiments/studies/tuning/tuner.h"
#include "experiments/studies/tuning/tuning_report.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"

namespace turbidock::tuning {
namespace {

constexpr double kLogEvery_s = 20;

struct TuneArguments {
  trial::Plugins plugins;
  std::string study, out, figure;
  app::FarmArguments farm;
  bool json = false, quiet = false;
};

int Tune(const TuneArguments& arguments) {
  const Study study = LoadStudy(arguments.study, arguments.plugins);
  if (!arguments.figure.empty()) media::RequireFigurePath(arguments.figure);
  const std::string file = arguments.out + "/evaluations.sqlite";
  system::OutputPlan()
      .Reads(arguments.study)
      .Reads(study.TrialsOf(0, 1).files())
      .Writes(arguments.figure)
      .Writes(file, system::kResultFile)
      .Writes(arguments.out + "/gains.yaml", kGainsFile)
      .Writes(arguments.out + "/report.html", page::kPageFile)
      .WritesInto(arguments.out, {"report.json", "report.md", "tuning.png"})
      .Require();
  media::RequireFigures();
  app::Progress progress(arguments.quiet);
  const StudySettings& settings = study.settings();
  progress.Say(fmt::format("{}: {} gains, {}, {} generations of {}, study {}", settings.description,
                           settings.gains.size(), NameOf(settings.optimiser.algorithm),
                           settings.optimiser.generations, settings.optimiser.population,
                           study.hash()));
  TuningOptions options;
  options.farm = arguments.farm.For(arguments.out + "/trials",
                                    [&](const std::string& text) { progress.Say("  " + text); });
  options.stop_requested = app::CatchStopSignals();
  options.on_progress = [&](const TuningProgress& now) {
    progress.ShowOrSay(now.share,
                       fmt::format("{}, {} trials, best {:.2f} ({:.0f} % docked)", now.phase,
                                   now.trials, now.best, 100 * now.best_success),
                       kLogEvery_s);
  };
  options.on_generation = [&](const GenerationRecord& g) {
    progress.Say(fmt::format(
        "  {:3}: best {:8.2f}, median {:8.2f}, incumbent {:8.2f} ({:.0f} % docked), {} of {} given "
        "up, {} trials{}",
        g.generation, g.best, g.median, g.incumbent, 100 * g.incumbent_success, g.given_up,
        g.candidates, g.trials, g.replaced ? ", replaced" : ""));
  };
  TuningResult result;
  try {
    result = Tune(study, file, options);
  } catch (const Stopped&) {
    progress.Say(
        fmt::format("stopped: the trials so far are in {}; the same command goes on", file));
    return app::kExitDone;  // main makes the signal's code of it
  } catch (const HopelessStart& error) {
    std::fprintf(stderr, "turbidock: %s\n", system::OneLineOf(error.what()).c_str());
    return app::kExitCheckFailed;
  }
  system::WriteWhole(arguments.out + "/gains.yaml", GainsYaml(study, result));
  system::WriteWhole(arguments.out + "/report.json", TuningJson(study, result));
  system::WriteWhole(arguments.out + "/report.md", TuningMarkdown(study, result));
  WriteTuningFigure(arguments.out + "/tuning.png", study, result);
  if (!arguments.figure.empty()) WriteTuningFigure(arguments.figure, study, result);
  page::WritePage(arguments.out + "/report.html", page::StudyFolderPage(arguments.out));
  if (arguments.json)
    std::fputs(TuningJson(study, result).c_str(), stdout);
  else
    std::fputs(TuningMarkdown(study, result).c_str(), stdout);
  const double busy = result.wall_time_s * options.farm.capacity();
  progress.Say(fmt::format(
      "{} trials, {} of them run now in {:.0f} s, workers busy {:.1f} % of the time; gains.yaml, "
      "report.md, report.json, report.html, tuning.png in {}",
      result.trials, result.trials_run, result.wall_time_s,
      busy > 0 ? 100 * result.worker_time_s / busy : 0, arguments.out));
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
  tune.Add("--out", arguments.out,
           "Folder for gains.yaml, report and every evaluation; one that holds a part of the "
           "study is gone on with")
      .Required();
  arguments.farm.AddTo(&tune, "Processes that run trials", app::AvailableCores());
  tune.Add("--figure FILE", arguments.figure, "Draw tuning.png also here: .png, .svg or .pdf");
  tune.Flag("--json", arguments.json, "Print the report as JSON on stdout");
  tune.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::tuning
