#pragma once
// The subcommands of the program. Each adds itself to the command line and sets what to run.

#include <CLI/CLI.hpp>
#include <functional>

namespace turbidock::experiments::cli {

enum ExitCode {
  kExitDone = 0,
  kExitCheckFailed = 1,     // --expect, selftest --physics, gate
  kExitBadInput = 2,        // command line, file, key
  kExitInconclusive = 3,    // gate: its trials are spent
  kExitSimulatorFault = 4,  // this machine cannot simulate or draw
  kExitMismatch = 5         // merge, verify, replay: results differ that should not
};

using Command = std::function<int()>;  // returns the exit code

void AddBench(CLI::App& app, Command* chosen);
void AddCompareEstimators(CLI::App& app, Command* chosen);
void AddEstimate(CLI::App& app, Command* chosen);
void AddCalibrate(CLI::App& app, Command* chosen);
void AddRecognize(CLI::App& app, Command* chosen);
void AddRun(CLI::App& app, Command* chosen);
void AddBatch(CLI::App& app, Command* chosen);    // batch, plans, status, curve
void AddResults(CLI::App& app, Command* chosen);  // merge, export, verify, replay
void AddGate(CLI::App& app, Command* chosen);
void AddCompare(CLI::App& app, Command* chosen);
void AddSlurm(CLI::App& app, Command* chosen);
void AddScenarios(CLI::App& app, Command* chosen);
void AddTune(CLI::App& app, Command* chosen);  // tune, studies
void AddStepResponse(CLI::App& app, Command* chosen);
void AddSelftest(CLI::App& app, Command* chosen);

// The signal (SIGINT, SIGTERM) that asked the program to stop, or 0. Long work polls it and ends
// cleanly.
int StopSignal();

}  // namespace turbidock::experiments::cli
