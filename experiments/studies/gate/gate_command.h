#pragma once
// `turbidock gate`.

#include "experiments/app/commands.h"

namespace turbidock::gate {

void AddGate(app::CommandLine& line);

}  // namespace turbidock::gate
