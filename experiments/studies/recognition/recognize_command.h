#pragma once
// `turbidock recognize`.

#include "experiments/app/commands.h"

namespace turbidock::recognition {

void AddRecognize(app::CommandLine& line);

}  // namespace turbidock::recognition
