#pragma once
// The docking procedure: approach -> visual servoing -> docking -> docked, with the fall-back edges.

#include <cstdint>
#include <string>
#include <vector>

#include "sim/base/clock.h"
#include "sim/base/fields.h"
#include "sim/base/pose.h"

namespace turbidock::control {

enum class Stage { kApproach, kVisualServoing, kDocking, kDocked };

}  // namespace turbidock::control
