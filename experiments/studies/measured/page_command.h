#pragma once
// `turbidock page`.

#include "experiments/app/commands.h"

namespace turbidock::measured {

void AddPage(app::CommandLine& line);

}  // namespace turbidock::measured
