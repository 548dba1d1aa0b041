#pragma once
// `turbidock estimate`.

#include "experiments/app/commands.h"

namespace turbidock::estimate {

void AddEstimate(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::estimate
