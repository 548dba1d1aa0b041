#pragma once
// `turbidock bench`.

#include "experiments/app/commands.h"

namespace turbidock::bench {

void AddBench(app::CommandLine& line);

}  // namespace turbidock::bench
