#pragma once
// `turbidock estimate`.

#include "experiments/app/commands.h"

namespace turbidock::estimate {

void AddEstimate(app::CommandLine& line);

}  // namespace turbidock::estimate
