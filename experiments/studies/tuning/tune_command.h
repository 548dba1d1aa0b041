#pragma once
// `turbidock tune`.

#include "experiments/app/commands.h"

namespace turbidock::tuning {

void AddTune(app::CommandLine& line);

}  // namespace turbidock::tuning
