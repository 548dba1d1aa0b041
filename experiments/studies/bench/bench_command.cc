#include <fmt/format.h>

#include <filesystem>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/print_report.h"
#include "experiments/app/progress.h"
#include "experiments/studies/bench/bench.h"

namespace turbidock::bench {
namespace {

// The active and the passive marker: light from the balls, light from the lamps.
const std::vector<std::string> kDefaultScenarios = {"sea_night_active", "pool_passive"};

struct BenchArguments {
  std::vector<std::string> scenarios, assignments;
  BenchOptions options;
  bool json = false, quiet = false;
};

int Bench(const BenchArguments& arguments) {
  const auto& names = arguments.scenarios.empty() ? kDefaultScenarios : arguments.scenarios;
  const std::vector<std::string>& assignments = arguments.assignments;
  std::vector<trial::Scenario> scenarios;
  scenarios.reserve(names.size());
  for (const std::string& name : names) scenarios.push_back(trial::LoadScenario(name, assignments));

  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  app::Progress progress(arguments.quiet);
  BenchOptions options = arguments.options;
  std::vector<BenchResult> results;
  std::vector<WorkerCost> workers;
  for (size_t i = 0; i < scenarios.size(); ++i) {
    const auto count = static_cast<double>(scenarios.size());
    progress.Say(scenarios[i].description + ": start-up and memory of a worker");
    std::vector<std::string> as_run = {names[i]};
    for (const std::string& assignment : assignments) {
      as_run.emplace_back("--set");
      as_run.push_back(assignment);
    }
    workers.push_back(MeasureWorker(program, as_run));
    progress.Say(scenarios[i].description + ": the loop and bare rendering by turns");
    options.progress = [&](double share, const std::string& words) {
      progress.Show((static_cast<double>(i) + share) / count, words);
    };
    results.push_back(RunBench(scenarios[i], options));
  }
  app::PrintReport(ReportOf(results, workers), ResultJson(results, workers), arguments.json);
  return app::kExitDone;
}

}  // namespace

void AddBench(app::CommandLine& line) {
  auto [bench, arguments] = line.Add(
      "bench", "Time the closed loop, stage by stage, against bare rendering of the same views",
      &Bench);
  bench.Add("scenario", arguments.scenarios,
            "YAML files or names of bundled scenarios (default: sea_night_active and "
            "pool_passive)");
  bench.AddSet(arguments.assignments, "Set one key in all of them, such as water.milk_ml_m3=20");
  bench.Add("--frames", arguments.options.frames, "Frames of a trial").Between(2, 1000000);
  bench.Add("--repeats", arguments.options.repeats, "Times that each trial is run")
      .Between(1, 1000);
  bench.AddJson(arguments.json);
  bench.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::bench
