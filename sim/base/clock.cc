#include "sim/base/clock.h"

#include <cmath>

namespace turbidock {

int64_t ClockParams::FramesFor(double seconds) const {
  // A hair below the ceiling, so that 0.1 s at 30 Hz is 3 frames and not 4.
  return static_cast<int64_t>(std::ceil(seconds * frames_per_second - 1e-9));
}

}  // namespace turbidock
