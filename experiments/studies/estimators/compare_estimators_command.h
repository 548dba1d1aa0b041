#pragma once
// `turbidock compare-estimators`.

#include "experiments/app/commands.h"

namespace turbidock::estimators {

void AddCompareEstimators(app::CommandLine& line);

}  // namespace turbidock::estimators
