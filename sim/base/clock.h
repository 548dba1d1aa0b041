#pragma once
// Time is counted in whole physics ticks; a camera frame is a whole number of them.

#include <cstdint>

#include "sim/base/fields.h"

namespace turbidock {

struct ClockParams {
  int frames_per_second = 30;
  int ticks_per_frame = 16;  // 1/480 s: 2 ms would not divide a 30 Hz frame

  static void Fields(auto& self, auto&& field) {
    field("frames_per_second", self.frames_per_second, InRange(1, 240),
          "number of frames a second: cycles of images, estimate and command");
    field("ticks_per_frame", self.ticks_per_frame, InRange(1, 1000),
          "number of physics steps in a frame");
  }

  double dt_s() const { return 1.0 / (static_cast<double>(frames_per_second) * ticks_per_frame); }
  double frame_s() const { return 1.0 / frames_per_second; }
  double TimeOfTick(int64_t tick) const { return static_cast<double>(tick) * dt_s(); }
  double TimeOfFrame(int64_t frame) const { return static_cast<double>(frame) / frames_per_second; }
  // Number of whole frames that last at least `seconds`.
  int64_t FramesFor(double seconds) const;
};

}  // namespace turbidock
