#pragma once
// `turbidock recognize`.

#include "experiments/app/commands.h"

namespace turbidock::recognition {

void AddRecognize(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::recognition
