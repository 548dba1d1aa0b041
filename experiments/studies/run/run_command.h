#pragma once
// `turbidock run`.

#include "experiments/app/commands.h"

namespace turbidock::run {

void AddRun(app::CommandLine& line);

}  // namespace turbidock::run
