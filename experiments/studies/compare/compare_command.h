#pragma once
// `turbidock compare`.

#include "experiments/app/commands.h"

namespace turbidock::compare {

void AddCompare(app::CommandLine& line);

}  // namespace turbidock::compare
