// How well the fitness of an estimate tells its error.

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "experiments/studies/estimators/compare_estimators.h"
#include "sim/base/published.h"

namespace turbidock::estimators {
namespace {

std::vector<double> RanksOf(const std::vector<double>& values) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (size_t i = 0; i < order.size();) {  // equal values share the mean of their ranks
    size_t end = i + 1;
    while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
    for (size_t j = i; j < end; ++j) ranks[order[j]] = 0.5 * static_cast<double>(i + end - 1);
    i = end;
  }
  return ranks;
}

bool IsOf(const CompareRow& row, recognition::MarkerKind marker, const std::string& estimator) {
  return row.cell.marker == marker && row.estimator == estimator;
}

}  // namespace

double FitnessErrorCorrelation(const std::vector<CompareRow>& rows, recognition::MarkerKind marker,
                               const std::string& estimator) {
  std::vector<double> errors, fitness;
  for (const CompareRow& row : rows) {
    if (!IsOf(row, marker, estimator)) continue;
    errors.insert(errors.end(), row.errors_m.begin(), row.errors_m.end());
    fitness.insert(fitness.end(), row.fitness.begin(), row.fitness.end());
  }
  const std::vector<double> a = RanksOf(errors), b = RanksOf(fitness);
  const double middle = 0.5 * (static_cast<double>(a.size()) - 1);
  double ab = 0, aa = 0, bb = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - middle) * (b[i] - middle);
    aa += (a[i] - middle) * (a[i] - middle);
    bb += (b[i] - middle) * (b[i] - middle);
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

std::vector<FitnessBin> FitnessBins(const std::vector<CompareRow>& rows,
                                    recognition::MarkerKind marker, const std::string& estimator) {
  constexpr auto kEdges = std::to_array(
      {-0.2, published::kDetectedFitness, published::kReliableFitness, 0.7, 0.8, 0.9, 1.0});
  std::vector<FitnessBin> bins;
  for (size_t i = 0; i + 1 < kEdges.size(); ++i) {
    const bool last = i + 2 == kEdges.size();
    FitnessBin bin{.low = kEdges[i], .high = kEdges[i + 1]};
    std::vector<double> errors_m, rotations_rad;
    for (const CompareRow& row : rows) {
      if (!IsOf(row, marker, estimator)) continue;
      for (size_t k = 0; k < row.fitness.size(); ++k) {
        if (row.fitness[k] < bin.low || (row.fitness[k] >= bin.high && !last)) continue;
        errors_m.push_back(row.errors_m[k]);
        rotations_rad.push_back(row.rotations_rad[k]);
        bin.found += row.is_found[k];
      }
    }
    bin.starts = static_cast<int>(errors_m.size());
    if (bin.starts == 0) continue;
    bin.found_interval = statistics::WilsonInterval(bin.found, bin.starts);
    bin.error_median_m = *statistics::Median(errors_m);
    bin.error_95_m = *statistics::Quantile(errors_m, 0.95);
    bin.rotation_median_rad = *statistics::Median(rotations_rad);
    bin.rotation_95_rad = *statistics::Quantile(rotations_rad, 0.95);
    bins.push_back(bin);
  }
  return bins;
}

}  // namespace turbidock::estimators
