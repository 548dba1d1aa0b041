#pragma once
// `turbidock bench`.

#include "experiments/app/commands.h"

namespace turbidock::bench {

void AddBench(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::bench
