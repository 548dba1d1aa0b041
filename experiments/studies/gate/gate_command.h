#pragma once
// `turbidock gate`.

#include "experiments/app/commands.h"

namespace turbidock::gate {

void AddGate(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::gate
