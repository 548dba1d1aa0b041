#pragma once
// `turbidock step-response`.

#include "experiments/app/commands.h"

namespace turbidock::step_response {

void AddStepResponse(app::CommandLine& line);

}  // namespace turbidock::step_response
