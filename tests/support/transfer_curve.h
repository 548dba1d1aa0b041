#pragma once
// The cameras' transfer curves as their standards write them, to compare the sensor with.

#include <cmath>

#include "sim/camera/sensor_params.h"

namespace turbidock::testing {

// Encoded value in [0, 1] of a linear one in [0, 1].
inline double Encode(const camera::SensorParams& params, double linear) {
  if (linear < 0) {
    // below zero the straight part at the curve's foot goes on; a power has none
    const double foot = 1e-9;
    const bool straight = params.transfer != camera::TransferCurve::kPower;
    return straight ? linear * Encode(params, foot) / foot : 0;
  }
  switch (params.transfer) {
    case camera::TransferCurve::kNtsc:  // SMPTE 170M
      return linear < 0.018 ? 4.5 * linear : 1.099 * std::pow(linear, 0.45) - 0.099;
    case camera::TransferCurve::kSrgb:  // IEC 61966-2-1
      return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
    case camera::TransferCurve::kLinear:
      return linear;
    case camera::TransferCurve::kPower:
      break;
  }
  return std::pow(linear, 1 / params.power);
}

// The linear value that is encoded so, by bisection.
inline double Decode(const camera::SensorParams& params, double encoded) {
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (Encode(params, middle) < encoded ? low : high) = middle;
  }
  return high;
}

}  // namespace turbidock::testing
