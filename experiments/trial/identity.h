#pragma once
// What a trial's result follows from, as one digest. Results are kept by it: two trials of the same
// identity have the same result, wherever and whenever they run.

#include <string>

#include "experiments/trial/scenario.h"

namespace turbidock::trial {

// Of a resolved scenario: its values, the content of the files that it reads (`model_files`; not
// where they are), `program` (system::BuildId), the code of the controller and the estimator that
// it chooses where they are not this program's own, and what drew (TrialResult::renderer; empty
// where nothing did).
std::string IdentityOf(const Scenario& scenario, const std::string& program,
                       const std::string& renderer);

// ConfigError that names a file which is not what the scenario's `model_files` say.
void RequireSameFiles(const Scenario& scenario);

}  // namespace turbidock::trial
