#pragma once
// `turbidock calibrate`.

#include "experiments/app/commands.h"

namespace turbidock::recognition {

void AddCalibrate(app::CommandLine& line);

}  // namespace turbidock::recognition
