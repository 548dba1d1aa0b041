#pragma once
// Binomial probabilities by their recurrence, apart from the product's own sums.

#include <cmath>

namespace turbidock::testing {

// P(at most k of n), each with probability p.
inline double BinomialAtMost(int k, int n, double p) {
  double term = std::pow(1 - p, n), sum = 0;
  for (int i = 0; i <= k; ++i) {
    sum += term;
    term *= (n - i) * p / ((i + 1) * (1 - p));
  }
  return sum;
}

}  // namespace turbidock::testing
