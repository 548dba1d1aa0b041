#pragma once
// Smaller or larger images from the same cameras: --resolution 320x240.

#include <string>

#include "experiments/trial/scenario.h"

namespace turbidock::trial {

struct Resolution {
  int width_px = 0, height_px = 0;
};

// "320x240". ConfigError for anything else.
Resolution ParseResolution(const std::string& text);

// Gives both cameras this size. The field of view across stays, so focal length and principal point
// follow; counts of pixels that the estimator goes by follow the number of pixels.
void SetResolution(const Resolution& resolution, Scenario* scenario);

}  // namespace turbidock::trial
