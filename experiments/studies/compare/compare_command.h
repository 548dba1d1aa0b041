#pragma once
// `turbidock compare`.

#include "experiments/app/commands.h"

namespace turbidock::compare {

void AddCompare(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::compare
