#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/progress.h"
#include "experiments/farm/result_store.h"
#include "experiments/page/batch_page.h"
#include "experiments/page/result_page.h"
#include "experiments/page/study_page.h"
#include "experiments/studies/live/live_view.h"
#include "experiments/studies/live/results_view.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial_files.h"

namespace turbidock::live {
namespace {

namespace fs = std::filesystem;

constexpr int kUsualPort = 8137;

struct ViewArguments {
  trial::Plugins plugins;
  std::string what = "sea_night_active";
  std::vector<std::string> assignments;
  std::string gains, seed, listen = "127.0.0.1";
  int port = kUsualPort, quality = 80;
  std::optional<std::string> out;
  bool quiet = false;
};

std::string SummaryText(const ViewSummary& s) {
  std::string text = fmt::format("{} frames", s.frames);
  if (s.frames > 0)
    text += fmt::format(", {:.1f} ms each", 1e3 * s.step_s / static_cast<double>(s.frames));
  if (s.pictures > 0)
    text += fmt::format("; {} pairs of pictures, {:.1f} ms and {:.0f} kB each", s.pictures,
                        1e3 * s.encode_s / static_cast<double>(s.pictures),
                        1e-3 * static_cast<double>(s.bytes) / static_cast<double>(s.pictures));
  return text;
}

enum class Kind { kScenario, kResult, kGrowing };

// A folder or a JSON document is a result; a file of trials and the folder of a study that is not
// done may still grow; all else is a scenario.
Kind KindOf(const std::string& what) {
  std::error_code ignored;
  if (fs::is_directory(what, ignored))
    return page::TrialsOfUnfinishedStudy(what) ? Kind::kGrowing : Kind::kResult;
  if (fs::path(what).extension() == ".json") return Kind::kResult;
  return page::IsFileOfTrials(what) ? Kind::kGrowing : Kind::kScenario;
}

// Of a file of trials, or of a study's folder: its report once there is one.
page::Page PageOfGrowing(const std::string& what, const std::string& file,
                         const trial::Plugins& plugins) {
  const farm::ResultStore store = farm::ResultStore::Read(file);
  if (what == file || page::TrialsOfUnfinishedStudy(what))
    return page::BatchPage(store, file, {.plugins = plugins});
  page::Page page = page::StudyFolderPage(what, plugins);
  page.model["rows"] = store.Done().size();
  return page;
}

// What only a scenario can follow. ConfigError for what was given besides a result.
void RefuseScenarioOptions(const ViewArguments& arguments) {
  if (!arguments.assignments.empty() || !arguments.gains.empty() || !arguments.seed.empty() ||
      arguments.out)
    throw ConfigError(arguments.what +
                      ": is a result; --set, --gains, --seed and --out are for scenarios");
}

// Serves a trial that runs now.
void ViewScenario(const ViewArguments& arguments, ViewOptions options) {
  app::Progress progress(arguments.quiet);
  std::vector<std::string> assignments = arguments.assignments;
  if (!arguments.seed.empty()) assignments.push_back("seed=" + arguments.seed);
  options.jpeg_quality = arguments.quality;
  options.say = [&](const std::string& line) { progress.Say(line); };
  const trial::Scenario scenario =
      trial::LoadScenario(arguments.what, assignments, arguments.gains, arguments.plugins);
  if (arguments.out)
    system::OutputPlan()
        .Reads(arguments.what)
        .Reads(arguments.gains)
        .WritesInto(*arguments.out, trial::kRecordFiles)
        .Require();
  progress.Say(fmt::format("{}, seed {}", scenario.description, scenario.seed));
  progress.Say(SummaryText(ServeTrial(scenario, options)));
}

int View(const ViewArguments& arguments) {
  const serve::Place place{.address = arguments.listen, .port = arguments.port};
  const auto on_served = [&](const std::string& url) {
    std::printf("%s\n", url.c_str());
    std::fflush(stdout);
    app::Progress(arguments.quiet).Say("open this address in a browser; Ctrl-C ends");
  };
  const auto stop_requested = app::CatchStopSignals();  // a trial that is cut off has its record
  const ResultsOptions results{
      .place = place, .on_served = on_served, .stop_requested = stop_requested};
  const std::string& what = arguments.what;
  switch (KindOf(what)) {
    case Kind::kScenario:
      ViewScenario(arguments, {.place = place,
                               .out = arguments.out,
                               .on_served = on_served,
                               .say = {},
                               .stop_requested = stop_requested});
      break;
    case Kind::kResult:
      RefuseScenarioOptions(arguments);
      ServePage(page::ResultPage(what, arguments.plugins), results);
      break;
    case Kind::kGrowing: {
      RefuseScenarioOptions(arguments);
      const std::string file = page::TrialsOfUnfinishedStudy(what).value_or(what);
      ServeResults(
          file, [&] { return PageOfGrowing(what, file, arguments.plugins); }, results);
      break;
    }
  }
  return app::kExitDone;
}

}  // namespace

void AddView(app::CommandLine& line) {
  auto [view, arguments] = line.Add(
      "view", "Watch a trial, a batch or a study while it runs, in a browser on this machine",
      &View);
  arguments.plugins = line.plugins();
  view.Add("what", arguments.what,
           "A scenario (YAML file or a bundled one's name), which runs; or a result: a trial's, a\n"
           "gate's or a study's folder, a file of trials; batches and studies also while they run");
  view.AddSet(arguments.assignments, "Set one key, such as water.milk_ml_m3=20");
  view.Add("--gains", arguments.gains, "Gains file, read over the scenario");
  view.AddSeed(arguments.seed);
  view.Add("--port", arguments.port, "Where to listen; 0 for any port that is free")
      .Between(0, 65535);
  view.Add("--listen ADDRESS", arguments.listen,
           "Address to listen at: another than this machine's own lets others in who know the "
           "secret in the address");
  view.Add("--quality", arguments.quality, "Of the cameras' pictures (JPEG)").Between(1, 100);
  view.Add("--out FOLDER", arguments.out,
           "Folder for result.json, resolved.yaml and trajectory.csv of the last trial that ended");
  view.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::live
