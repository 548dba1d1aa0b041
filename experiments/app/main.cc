// The program: command line in, exit code out. See `turbidock --help`.

#include <csignal>
#include <cstdio>
#include <exception>

#include "experiments/app/build_table.h"
#include "experiments/app/commands.h"
#include "experiments/app/stop_signal.h"
#include "experiments/farm/result_store.h"
#include "sim/base/check.h"

namespace turbidock::app {
namespace {

int ParseAndRun(int argc, char** argv) {
  CommandLine line("turbidock",
                   "Headless closed-loop docking trials of a stereo-vision ROV in turbid water.");
  line.Program().Footer(
      "Exit codes: 0 done, 1 a check failed, 2 bad usage or input, 3 inconclusive (gate), 4 this\n"
      "machine cannot simulate or draw, 5 results differ that should not, 130/143 stopped by a\n"
      "signal. Results go to stdout, everything else to stderr.");
  bool version = false;
  line.Program().Flag("--version", version, "Versions of the program and of what it runs on");
  for (const auto add :
       {bench::AddBench, run::AddRun, live::AddView, AddBatch, AddResults, AddReport, gate::AddGate,
        compare::AddCompare, estimate::AddEstimate, estimators::AddCompareEstimators,
        recognition::AddRecognize, recognition::AddCalibrate, AddSlurm, tuning::AddTune,
        step_response::AddStepResponse, AddScenarios, AddSelftest})
    add(line);
  if (const std::optional<int> code = line.Parse(argc, argv)) return *code;
  if (version) {
    for (const auto& [name, value] : BuildTable())
      std::printf("%s %s\n", name.c_str(), value.c_str());
    return kExitDone;
  }
  CatchStopSignals();
  std::signal(SIGXFSZ, SIG_IGN);  // a file at its size limit is an error of write, not the end
  const std::optional<int> code = line.Run();
  if (!code) {
    std::fputs(line.Help().c_str(), stderr);
    return kExitBadInput;
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout))
    throw ConfigError("the standard output cannot be written");
  return StopSignal() ? 128 + StopSignal() : *code;
}

}  // namespace
}  // namespace turbidock::app

int main(int argc, char** argv) {
  try {
    return turbidock::app::ParseAndRun(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "turbidock: %s\n", error.what());
    if (dynamic_cast<const turbidock::ConfigError*>(&error)) return turbidock::app::kExitBadInput;
    if (dynamic_cast<const turbidock::farm::MismatchError*>(&error))
      return turbidock::app::kExitMismatch;
    return turbidock::app::kExitSimulatorFault;  // SimulatorFault, or a machine out of memory
  }
}
