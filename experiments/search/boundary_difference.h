#pragma once
// How two boundaries differ, where some trials of both were of the same seed.
//
// Both may have any shape. A shift that pairs tell (studies/gate/envelope_gate.h) is for one thing
// that runs again: there it tells small losses sooner, but of cases whose slopes differ (30 and 10
// in log odds over the range) it held 21 of 40 differences and told 14 of 40 that were none; this
// held all.

#include <vector>

#include "experiments/search/boundary_search.h"

namespace turbidock::search {

// A trial of a cell with A and one with B that have the seed in common.
struct TrialPair {
  int cell = 0;
  bool a = false, b = false;  // succeeded
};

// Median and 95 % interval.
struct Estimate {
  double value = 0, low = 0, high = 0;
};

// B less A.
struct Difference : Estimate {
  double correlation = 0;  // of both sides' errors, from the pairs
};

// `of_a`, `of_b`: a number for each draw of a boundary, such as where it crosses a line. What is
// drawn for A and for B is independent. Then the spread is that of independent errors, less what
// the pairs have in common: a success moves the posterior mean of a number by its posterior
// covariance with the cell's log odds (exact for a logistic likelihood; the infinitesimal jackknife
// of Giordano and Broderick, arXiv:2305.06466), so products of residuals sum up to the covariance
// of both.
Difference DifferenceOf(const Boundary& a, const std::vector<double>& of_a, const Boundary& b,
                        const std::vector<double>& of_b, const std::vector<TrialPair>& pairs);

}  // namespace turbidock::search
