#pragma once
// Fixed awkward inputs for law tests.

#include <vector>

#include "sim/base/pose.h"

namespace turbidock::testing {

// Identity, half turns, tiny angles, large and tiny translations, -q, and products of these.
std::vector<Pose> AwkwardPoses();

}  // namespace turbidock::testing
