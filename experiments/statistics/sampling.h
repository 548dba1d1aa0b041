#pragma once
// Numbers in (0, 1) for the trials of a study, and the distributions that they become.

#include <vector>

#include "sim/base/random.h"

namespace turbidock::statistics {

// A number in (0, 1), never 0 or 1.
double OpenUniform(Rng* rng);
// One in each of n equal parts of (0, 1), in random order: a column of a Latin hypercube (McKay,
// Beckman and Conover 1979).
std::vector<double> StratifiedSamples(int n, Rng* rng);

// Quantile functions: the value below which lies the share u of a distribution.
double UniformAt(double u, double low, double high);
double LogUniformAt(double u, double low, double high);  // 0 < low < high
double NormalAt(double u, double mean, double deviation);
double NormalAt(double u, double mean, double deviation, double low, double high);  // cut off

}  // namespace turbidock::statistics
