#include <string>
#include <vector>

#include "experiments/command/command_line.h"
#include "experiments/command/progress.h"
#include "experiments/command/report_output.h"
#include "experiments/studies/bench/bench.h"
#include "experiments/studies/bench/instructions.h"

namespace turbidock::bench {
namespace {

struct BenchArguments {
  // The active and the passive marker: light from the balls, light from the lamps.
  std::vector<std::string> scenarios = {"sea_night_active", "pool_passive"}, assignments;
  std::string gains, instructions;
  bool update = false, traffic = false;
  BenchOptions options;
  bool json = false, quiet = false;
};

int BenchInstructions(const BenchArguments& arguments) {
  const Instructions table = ReadInstructions(arguments.instructions);
  command::Progress(arguments.quiet).Say("trials under valgrind, some minutes");
  const Instructions now = CountInstructions(arguments.traffic);
  command::PrintReport(ReportOf(now, table), report::Json(now), arguments.json);
  if (arguments.update) WriteInstructions(arguments.instructions, now);
  return arguments.update || Grown(now, table).empty() ? command::kExitDone
                                                       : command::kExitCheckFailed;
}

int Bench(const BenchArguments& arguments) {
  if (!arguments.instructions.empty()) return BenchInstructions(arguments);
  std::vector<trial::Scenario> scenarios;
  for (const std::string& name : arguments.scenarios)
    scenarios.push_back(trial::LoadScenario(name, arguments.assignments, arguments.gains));
  command::Progress progress(arguments.quiet);
  BenchOptions options = arguments.options;
  std::vector<BenchResult> results;
  for (const trial::Scenario& scenario : scenarios) {
    progress.Say(scenario.description + ": the loop and bare rendering by turns");
    options.on_repeat = [&](int done) {
      progress.ShowDone(std::ssize(results) * options.repeats + done,
                        std::ssize(scenarios) * options.repeats, "trials", 10);
    };
    results.push_back(RunBench(scenario, options));
  }
  const report::Json result = ResultJson(results);
  command::PrintReport(ReportOf(result), result, arguments.json);
  return command::kExitDone;
}

}  // namespace

void AddBench(command::CommandLine& line) {
  auto [bench, arguments] = line.Add(
      "bench", "Time the closed loop, stage by stage, against bare rendering of the same views",
      &Bench);
  bench.Add("scenario", arguments.scenarios, "YAML files or names of bundled scenarios");
  bench.AddSet(arguments.assignments, "Set one key in all of them, such as water.milk_ml_m3=20");
  bench.AddGains(arguments.gains);
  bench.Add("--frames", arguments.options.frames, "Frames of a trial").Between(2, 1000000);
  bench.Add("--repeats", arguments.options.repeats, "Times that each trial is run")
      .Between(1, 1000);
  const command::Option instructions =
      bench.Add("--instructions TABLE.csv", arguments.instructions,
                "Count instructions under valgrind instead, and compare them with this table; 1 "
                "when a stage takes more than 5 % more");
  bench.Flag("--update", arguments.update, "Put what was counted into the table")
      .Needs(instructions);
  bench
      .Flag("--traffic", arguments.traffic,
            "Count accesses to data and bytes to and from memory, by valgrind's model of caches")
      .Needs(instructions);
  bench.AddJson(arguments.json);
  bench.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::bench
