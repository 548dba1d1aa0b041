#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/result_store.h"
#include "experiments/command/command_line.h"
#include "experiments/command/progress.h"
#include "experiments/page/batch_page.h"
#include "experiments/page/report_page.h"
#include "experiments/studies/live/live_view.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::live {
namespace {

namespace fs = std::filesystem;

constexpr int kUsualPort = 8137;

struct ViewArguments {
  trial::Plugins plugins;
  std::string what = "sea_night_active";
  std::vector<std::string> assignments;
  std::string gains, seed, listen = "127.0.0.1";
  int port = kUsualPort;
  std::optional<std::string> out;
  bool quiet = false;
};

// A folder, a JSON document and a file of trials are results; all else is a scenario.
bool IsResult(const std::string& what) {
  std::error_code none;
  return fs::is_directory(what, none) || fs::path(what).extension() == ".json" ||
         page::IsFileOfTrials(what);
}

// How often a page of what still runs loads itself again.
constexpr double kAgain_s = 5;

page::Page PageOf(const std::string& what, const trial::Plugins& plugins) {
  page::Page page = page::IsFileOfTrials(what) ? page::BatchPage(batch::ResultStore::Read(what),
                                                                 what, {.plugins = plugins})
                                               : page::ResultPage(what, plugins);
  const std::string file = page::TrialsOfStudy(what).value_or(what);
  if (page::IsFileOfTrials(file) && batch::IsLocked(file)) page.model["again_s"] = kAgain_s;
  return page;
}

// Serves a trial that runs now.
void ViewScenario(const ViewArguments& arguments, const ServeOptions& served) {
  command::Progress progress(arguments.quiet);
  std::vector<std::string> assignments = arguments.assignments;
  command::SetSeed(arguments.seed, &assignments);
  const trial::Scenario scenario =
      trial::LoadScenario(arguments.what, assignments, arguments.gains, arguments.plugins);
  if (arguments.out)
    system::OutputPlan()
        .Reads(arguments.what)
        .Reads(arguments.gains)
        .WritesInto(*arguments.out, trial::kRecordFiles)
        .Require();
  progress.Say(fmt::format("{}, seed {}", scenario.description, scenario.seed));
  ServeTrial(scenario, served, [&](const trial::Scenario& began, const trial::TrialResult& result) {
    progress.Say(fmt::format("seed {}: {}: {}, digest {}, {} settings changed on the way",
                             began.seed, NameOf(result.outcome), result.reason, result.digest,
                             result.changes.size()));
    if (arguments.out) trial::WriteRecords(*arguments.out, began, result);
  });
}

int View(const ViewArguments& arguments) {
  const ServeOptions options{
      .endpoint = {.address = arguments.listen, .port = arguments.port},
      .on_served =
          [&](const std::string& url) {
            std::printf("%s\n", url.c_str());
            std::fflush(stdout);
            command::Progress(arguments.quiet).Say("open this address in a browser; Ctrl-C ends");
          },
      .stop_requested = command::CatchStopSignals()};  // a trial that is cut off has its record
  if (IsResult(arguments.what)) {
    if (!arguments.assignments.empty() || !arguments.gains.empty() || !arguments.seed.empty() ||
        arguments.out)
      throw ConfigError(arguments.what +
                        ": is a result; --set, --gains, --seed and --out are for scenarios");
    ServeResult([&] { return PageOf(arguments.what, arguments.plugins); }, options);
  } else {
    ViewScenario(arguments, options);
  }
  return command::kExitDone;
}

}  // namespace

void AddView(command::CommandLine& line) {
  auto [view, arguments] = line.Add(
      "view", "Watch a trial, a batch or a study while it runs, in a browser on this machine",
      &View);
  arguments.plugins = line.plugins();
  view.Add("what", arguments.what,
           "A scenario (YAML file or a bundled one's name), which runs; or a result: a trial's, a\n"
           "gate's or a study's folder, a file of trials; batches and studies also while they run");
  view.AddSet(arguments.assignments, "Set one key, such as water.milk_ml_m3=20");
  view.AddGains(arguments.gains);
  view.AddSeed(arguments.seed);
  view.Add("--port", arguments.port, "Where to listen; 0 for any port that is free")
      .Between(0, 65535);
  view.Add("--listen ADDRESS", arguments.listen,
           "Address to listen at: another than this machine's own lets others in who know the "
           "secret in the address");
  view.Add("--out FOLDER", arguments.out,
           "Folder for result.json, resolved.yaml and trajectory.csv of the last trial that ended");
  view.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::live
