#pragma once
// Keys that change no trial because another key is as it is.

#include <string>
#include <vector>

#include "experiments/trial/scenario.h"

namespace turbidock::trial {

// "water.background = pure": what has this key, or all of this group, change no trial of the
// scenario. Empty where it may change one: choices, switches and amounts of nothing are known here,
// values that merely happen not to matter are not.
std::string SwitchedOffBy(const Scenario& scenario, const std::string& key);

// What people should know of how the scenario was set, a sentence each: what presets undid of it,
// and what was named but is switched off.
std::vector<std::string> RemarksOn(const Scenario& scenario);

}  // namespace turbidock::trial
