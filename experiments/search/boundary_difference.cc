#include "experiments/search/boundary_difference.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sim/base/check.h"
#include "sim/base/random.h"

namespace turbidock::search {
namespace {

double MeanOf(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double VarianceOf(const std::vector<double>& values) {
  const double mean = MeanOf(values);
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return sum / static_cast<double>(values.size());
}

// By how much a success in a cell moves the mean of the numbers.
double Influence(const Boundary& boundary, const std::vector<double>& of, double mean, int cell) {
  double sum = 0;
  for (size_t i = 0; i < of.size(); ++i)
    sum += (of[i] - mean) * static_cast<double>(boundary.draws[i][static_cast<size_t>(cell)]);
  return sum / static_cast<double>(of.size());
}

double CovarianceOf(const Boundary& a, const std::vector<double>& of_a, const Boundary& b,
                    const std::vector<double>& of_b, const std::vector<TrialPair>& pairs) {
  std::vector<double> products(a.rate.size());
  for (const TrialPair& pair : pairs) {
    const auto cell = static_cast<size_t>(pair.cell);
    products[cell] += (pair.a - a.rate[cell]) * (pair.b - b.rate[cell]);
  }
  const double mean_a = MeanOf(of_a), mean_b = MeanOf(of_b);
  double sum = 0;
  for (int cell = 0; cell < std::ssize(products); ++cell)
    if (const double product = products[static_cast<size_t>(cell)]; product != 0)
      sum += product * Influence(a, of_a, mean_a, cell) * Influence(b, of_b, mean_b, cell);
  return sum;
}

}  // namespace

Difference DifferenceOf(const Boundary& a, const std::vector<double>& of_a, const Boundary& b,
                        const std::vector<double>& of_b, const std::vector<TrialPair>& pairs) {
  TD_CHECK(
      of_a.size() == a.draws.size() && of_b.size() == b.draws.size() && of_a.size() == of_b.size(),
      "a number for each draw");
  constexpr double kMost = 0.95;  // estimated: never so sure that nothing is left
  const double variance_a = VarianceOf(of_a), variance_b = VarianceOf(of_b);
  const double both = std::sqrt(variance_a * variance_b);
  Difference difference;
  if (both > 0)
    difference.correlation =
        std::clamp(CovarianceOf(a, of_a, b, of_b, pairs) / both, -kMost, kMost);
  // Both were drawn with the same random numbers.
  std::vector<double> mixed = of_b;
  Rng rng = SeedTree(0).Stream("boundary.difference");
  for (size_t i = mixed.size(); i > 1; --i)
    std::swap(mixed[i - 1], mixed[rng.Below(static_cast<uint32_t>(i))]);
  for (size_t i = 0; i < mixed.size(); ++i) mixed[i] -= of_a[i];
  std::ranges::sort(mixed);
  const auto at = [&](double share) {
    return mixed[static_cast<size_t>(share * static_cast<double>(mixed.size() - 1))];
  };
  const double kept =
      both > 0 ? std::sqrt(1 - 2 * difference.correlation * both / (variance_a + variance_b)) : 1;
  difference.value = at(0.5);
  difference.low = difference.value + kept * (at(0.025) - difference.value);
  difference.high = difference.value + kept * (at(0.975) - difference.value);
  return difference;
}

}  // namespace turbidock::search
