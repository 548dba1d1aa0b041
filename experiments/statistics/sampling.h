#pragma once
// Numbers in (0, 1) for the trials of a study, and the distributions that they become.

#include <vector>

#include "sim/base/random.h"

namespace turbidock::statistics {

// `n` numbers in (0, 1), never 0 or 1.
std::vector<double> IndependentSamples(int n, Rng* rng);
// One in each of n equal parts of (0, 1), in random order: a column of a Latin hypercube (McKay,
// Beckman and Conover 1979).
std::vector<double> StratifiedSamples(int n, Rng* rng);
// The first n points of a Sobol sequence in one of its dimensions (Joe and Kuo's direction
// numbers), shifted by one random number, bit by bit. Columns of different dimensions fill the
// space between them evenly.
std::vector<double> SobolSamples(int n, int dimension, Rng* rng);
inline constexpr int kMaxSobolDimensions = 1000;

// Quantile functions: the value below which lies the share u of a distribution.
double UniformAt(double u, double low, double high);
double LogUniformAt(double u, double low, double high);  // 0 < low < high
double NormalAt(double u, double mean, double deviation);
double NormalAt(double u, double mean, double deviation, double low, double high);  // cut off

}  // namespace turbidock::statistics
