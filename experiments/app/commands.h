#pragma once
// The subcommands of the program. Each adds itself to the command line: those of batches stand
// beside this file, those of a study in its module.

#include "experiments/app/command_line.h"
#include "experiments/app/progress.h"

namespace turbidock::app {

void AddBatch(CommandLine& line);    // batch, status, slurm-task
void AddResults(CommandLine& line);  // merge, replay
void AddReport(CommandLine& line);
void AddList(CommandLine& line);

}  // namespace turbidock::app

#define TURBIDOCK_COMMAND(study, Add) \
  namespace turbidock::study {        \
  void Add(app::CommandLine& line);   \
  }
TURBIDOCK_COMMAND(bench, AddBench)
TURBIDOCK_COMMAND(check_vehicle, AddCheckVehicle)
TURBIDOCK_COMMAND(compare, AddCompare)
TURBIDOCK_COMMAND(dataset, AddDataset)
TURBIDOCK_COMMAND(estimate, AddEstimate)
TURBIDOCK_COMMAND(gate, AddGate)
TURBIDOCK_COMMAND(live, AddView)
TURBIDOCK_COMMAND(recognition, AddCalibrate)
TURBIDOCK_COMMAND(recognition, AddRecognize)
TURBIDOCK_COMMAND(run, AddRun)
TURBIDOCK_COMMAND(step_response, AddStepResponse)
TURBIDOCK_COMMAND(tuning, AddTune)
#undef TURBIDOCK_COMMAND
