#pragma once
// `turbidock run`.

#include "experiments/app/commands.h"

namespace turbidock::run {

void AddRun(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::run
