#pragma once
// `turbidock step-response`.

#include "experiments/app/commands.h"

namespace turbidock::step_response {

void AddStepResponse(CLI::App& app, app::Command* chosen);

}  // namespace turbidock::step_response
