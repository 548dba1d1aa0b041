#pragma once
// The subcommands of the program. Each adds itself to the command line and sets what to run.

#include "experiments/app/command_line.h"
#include "experiments/app/stop_signal.h"

namespace turbidock::app {

void AddBatch(CommandLine& line);    // batch, plans, status, curve
void AddResults(CommandLine& line);  // merge, export, verify, replay
void AddSlurm(CommandLine& line);
void AddScenarios(CommandLine& line);
void AddSelftest(CommandLine& line);

}  // namespace turbidock::app
