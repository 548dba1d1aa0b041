#include "experiments/statistics/rank_sum.h"

#include <cmath>
#include <map>

namespace turbidock::statistics {

double RankSumZ(std::span<const double> a, std::span<const double> b) {
  std::map<double, double> equal;
  double above = 0;
  for (const double of_a : a) {
    ++equal[of_a];
    for (const double of_b : b) above += of_a > of_b ? 1 : of_a == of_b ? 0.5 : 0;
  }
  for (const double of_b : b) ++equal[of_b];
  const auto n = static_cast<double>(a.size()), m = static_cast<double>(b.size()), all = n + m;
  double ties = 0;
  for (const auto& [value, t] : equal) ties += t * t * t - t;
  const double variance = n * m / 12 * (all + 1 - ties / (all * (all - 1)));
  return n == 0 || m == 0 || variance <= 0 ? 0 : (above - n * m / 2) / std::sqrt(variance);
}

}  // namespace turbidock::statistics
