#pragma once
// Whether one sample lies higher than another.

#include <span>

namespace turbidock::statistics {

// Wilcoxon's rank sum of `a` among both (Mann and Whitney, Ann. Math. Stat. 18 (1947) 50), ties
// counted half, less its mean and over its standard deviation when both are of one distribution
// (with ties: Lehmann, Nonparametrics (1975), section 1.4). Positive where `a` lies higher; 0 where
// one of them is empty or all are equal.
double RankSumZ(std::span<const double> a, std::span<const double> b);

}  // namespace turbidock::statistics
