#pragma once
// Conversions for the edge of the program: text and figures for people. Inside, everything is SI.

#include <numbers>

namespace turbidock::units {

inline constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr double DegFromRad(double rad) { return rad * kDegPerRad; }
constexpr double RadFromDeg(double deg) { return deg / kDegPerRad; }
constexpr double MmFromM(double m) { return 1000 * m; }
constexpr double MFromMm(double mm) { return mm / 1000; }

}  // namespace turbidock::units
