#pragma once
// What passes between the water model and the sensor.

#include "sim/base/image.h"

namespace turbidock::light {

// Linear radiance per channel at both cameras, W m^-2 sr^-1.
using RadianceStereo = Stereo<Image3f>;

}  // namespace turbidock::light
