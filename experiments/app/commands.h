#pragma once
// The subcommands of the program. Each adds itself to the command line and sets what to run.

#include <CLI/CLI.hpp>
#include <functional>

#include "experiments/app/stop_signal.h"

namespace turbidock::app {

enum ExitCode {
  kExitDone = 0,
  kExitCheckFailed = 1,     // --expect, selftest --physics, gate
  kExitBadInput = 2,        // command line, file, key
  kExitInconclusive = 3,    // gate: its trials are spent
  kExitSimulatorFault = 4,  // this machine cannot simulate or draw
  kExitMismatch = 5         // merge, verify, replay: results differ that should not
};

using Command = std::function<int()>;  // returns the exit code

void AddBatch(CLI::App& app, Command* chosen);    // batch, plans, status, curve
void AddResults(CLI::App& app, Command* chosen);  // merge, export, verify, replay
void AddSlurm(CLI::App& app, Command* chosen);
void AddScenarios(CLI::App& app, Command* chosen);
void AddSelftest(CLI::App& app, Command* chosen);

}  // namespace turbidock::app
