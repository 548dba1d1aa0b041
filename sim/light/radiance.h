#pragma once
// What passes between the water model and the sensor.

#include <cstdint>

#include "sim/base/image.h"

namespace turbidock::light {

// What the water model hands to the sensor: linear radiance per channel at both
// cameras, W m^-2 sr^-1.
struct RadianceStereo {
  int64_t tick = 0;
  Image3f left, right;
};

}  // namespace turbidock::light
