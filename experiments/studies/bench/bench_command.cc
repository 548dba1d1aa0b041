#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/command/command_line.h"
#include "experiments/command/progress.h"
#include "experiments/command/report_output.h"
#include "experiments/studies/bench/bench.h"
#include "experiments/studies/bench/instructions.h"
#include "experiments/system/output_path.h"

namespace turbidock::bench {
namespace {

struct BenchArguments {
  // The active and the passive marker: light from the balls, light from the lamps.
  std::vector<std::string> scenarios = {"sea_night_active", "pool_passive"}, assignments;
  std::string gains, instructions;
  bool update = false;
  BenchOptions options;
  bool json = false, quiet = false;
};

int BenchInstructions(const BenchArguments& arguments) {
  const std::string& file = arguments.instructions;
  system::OutputPlan outputs;
  if (arguments.update) outputs.Writes(file).Require();
  std::error_code ignored;
  std::optional<Instructions> table;
  if (!arguments.update || std::filesystem::exists(file, ignored)) table = ReadInstructions(file);
  command::Progress progress(arguments.quiet);
  progress.Say("trials under valgrind, a minute or two each");
  const auto now = CountInstructions(
      [&](int done, int of) { progress.Say(fmt::format("  {} of {} done", done, of)); },
      command::CatchStopSignals());
  if (!now) return command::kExitDone;
  command::PrintReport(ReportOf(*now, table.value_or(*now)), report::Json(*now), arguments.json);
  if (arguments.update) WriteInstructions(file, *now);
  return arguments.update || Grown(*now, *table).empty() ? command::kExitDone
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
  const std::vector<command::Option> timed = {
      bench.Add("scenario", arguments.scenarios, "YAML files or names of bundled scenarios"),
      bench.AddSet(arguments.assignments,
                   "Set one key in all of them, such as water.milk_ml_m3=20"),
      bench.AddGains(arguments.gains),
      bench.Add("--frames", arguments.options.frames, "Most frames of a trial").Between(2, 1000000),
      bench.Add("--repeats", arguments.options.repeats, "Times that each trial is run")
          .Between(1, 1000)};
  command::Option instructions =
      bench.Add("--instructions TABLE.csv", arguments.instructions,
                "Count instructions of three trials under valgrind instead, and compare them with "
                "this table; exit code 1 if a stage takes over 5 % more");
  for (const command::Option& option : timed) instructions.Excludes(option);
  bench.Flag("--update", arguments.update, "Write the table, or what was counted into it")
      .Needs(instructions);
  bench.Footer("What it measured: assets/measured/speed.md");
  bench.AddJson(arguments.json);
  bench.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::bench
