#pragma once
// A number in (0, 1) that a trial draws, and the distributions that it becomes one of.

#include "sim/base/random.h"

namespace turbidock::statistics {

// A number in (0, 1), never 0 or 1.
double OpenUniform(Rng* rng);

// Quantile functions: the value below which lies the share u of a distribution.
double UniformAt(double u, double low, double high);
double LogUniformAt(double u, double low, double high);  // 0 < low < high
double NormalAt(double u, double mean, double deviation);
double NormalAt(double u, double mean, double deviation, double low, double high);  // cut off

}  // namespace turbidock::statistics
