#pragma once
// When the cameras' images come.

#include <cstdint>

namespace turbidock {

// Image number n arrives (n + delay_images) * period_s after the beginning of the trial, and was
// exposed delay_s before.
struct ImageTimes {
  double period_s = 0;
  int64_t delay_images = 0;
  double delay_s = 0;
};

}  // namespace turbidock
