#pragma once
// The subcommands of the program. Each adds itself to the command line: those of batches stand
// beside this file, those of a study in its module.

#include "experiments/app/command_line.h"
#include "experiments/app/stop_signal.h"

namespace turbidock::app {

void AddBatch(CommandLine& line);    // batch, status
void AddResults(CommandLine& line);  // merge, export, verify, replay
void AddReport(CommandLine& line);
void AddSlurmTask(CommandLine& line);
void AddList(CommandLine& line);

}  // namespace turbidock::app

namespace turbidock {

namespace bench {
void AddBench(app::CommandLine& line);
}
namespace check_vehicle {
void AddCheckVehicle(app::CommandLine& line);
}
namespace compare {
void AddCompare(app::CommandLine& line);
}
namespace dataset {
void AddDataset(app::CommandLine& line);
}
namespace estimate {
void AddEstimate(app::CommandLine& line);
}
namespace estimators {
void AddCompareEstimators(app::CommandLine& line);
}
namespace gate {
void AddGate(app::CommandLine& line);
}
namespace live {
void AddView(app::CommandLine& line);
}
namespace recognition {
void AddCalibrate(app::CommandLine& line);
void AddRecognize(app::CommandLine& line);
}  // namespace recognition
namespace run {
void AddRun(app::CommandLine& line);
}
namespace step_response {
void AddStepResponse(app::CommandLine& line);
}
namespace tuning {
void AddTune(app::CommandLine& line);
}

}  // namespace turbidock
