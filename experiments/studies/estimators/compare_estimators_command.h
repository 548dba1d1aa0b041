#pragma once
// `turbidock compare-estimators`.

#include "experiments/app/commands.h"

namespace turbidock::estimators {

void AddCompareEstimators(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::estimators
