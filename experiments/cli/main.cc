// The program: command line in, exit code out. See `turbidock --help`.

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>

#include "experiments/batch/result_store.h"
#include "experiments/build_info.h"
#include "experiments/cli/commands.h"
#include "sim/base/check.h"

namespace turbidock::experiments::cli {
namespace {

// Written by the signal handler, which may touch nothing else.
volatile std::sig_atomic_t stop_signal = 0;

void OnSignal(int signal) {
  stop_signal = signal;
  std::signal(signal, SIG_DFL);  // a second one does not wait
}

std::string VersionText() {
  std::string text;
  for (const auto& [name, value] : BuildInfo()) text.append(name).append(" ").append(value) += '\n';
  text.pop_back();
  return text;
}

int ParseAndRun(int argc, char** argv) {
  CLI::App app("Headless closed-loop docking trials of a stereo-vision ROV in turbid water.");
  app.name("turbidock");
  app.footer(
      "Exit codes: 0 done, 1 a check failed, 2 bad usage or input, 3 inconclusive (gate), 4 this\n"
      "machine cannot simulate or draw, 5 results differ that should not, 130/143 stopped by a\n"
      "signal. Results go to stdout, everything else to stderr.");
  app.set_help_all_flag("--help-all", "Help of every subcommand");
  bool version = false;
  app.add_flag("--version", version, "Versions of the program and of what it runs on");
  app.require_subcommand(0, 1);
  Command chosen;
  AddBench(app, &chosen);
  AddRun(app, &chosen);
  AddBatch(app, &chosen);
  AddResults(app, &chosen);
  AddGate(app, &chosen);
  AddCompare(app, &chosen);
  AddEstimate(app, &chosen);
  AddCompareEstimators(app, &chosen);
  AddRecognize(app, &chosen);
  AddCalibrate(app, &chosen);
  AddSlurm(app, &chosen);
  AddTune(app, &chosen);
  AddStepResponse(app, &chosen);
  AddScenarios(app, &chosen);
  AddSelftest(app, &chosen);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help is an "error" of CLI11's with code 0.
    return app.exit(error) == 0 ? kExitDone : kExitBadInput;
  }
  if (version) {
    std::puts(VersionText().c_str());
    return kExitDone;
  }
  if (!chosen) {
    std::fputs(app.help().c_str(), stderr);
    return kExitBadInput;
  }

  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
  std::signal(SIGXFSZ, SIG_IGN);  // a file at its size limit is an error of write, not the end
  const int code = chosen();
  if (std::fflush(stdout) != 0 || std::ferror(stdout))
    throw ConfigError("the standard output cannot be written");
  return stop_signal ? 128 + stop_signal : code;
}

int Main(int argc, char** argv) {
  int code = kExitSimulatorFault;
  try {
    return ParseAndRun(argc, argv);
  } catch (const ConfigError& error) {
    code = kExitBadInput;
    std::fprintf(stderr, "turbidock: %s\n", error.what());
  } catch (const MismatchError& error) {
    code = kExitMismatch;
    std::fprintf(stderr, "turbidock: %s\n", error.what());
  } catch (const std::exception& error) {  // SimulatorFault, or a machine out of memory
    std::fprintf(stderr, "turbidock: %s\n", error.what());
  }
  return code;
}

}  // namespace

int StopSignal() { return stop_signal; }

}  // namespace turbidock::experiments::cli

int main(int argc, char** argv) { return turbidock::experiments::cli::Main(argc, argv); }
