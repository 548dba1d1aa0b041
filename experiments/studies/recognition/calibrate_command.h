#pragma once
// `turbidock calibrate`.

#include "experiments/app/commands.h"

namespace turbidock::recognition {

void AddCalibrate(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::recognition
