#pragma once
// `turbidock tune`.

#include "experiments/app/commands.h"

namespace turbidock::tuning {

void AddTune(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::tuning
