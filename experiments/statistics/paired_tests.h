#pragma once
// Two treatments on the same trials: is one better, by how much, and how sure is that?
//
// Pairs of one seed in several cells are alike: they are one unit, and what is sure follows from
// the number of units. A pair with a seed of its own is a unit by itself.

#include <cstdint>
#include <optional>
#include <vector>

#include "experiments/statistics/intervals.h"

namespace turbidock::statistics {

// Differences b - a of a number over pairs; all of them are finite.
struct PairedComparison {
  int64_t pairs = 0, seeds = 0;
  double mean = 0;        // of the differences
  Interval confidence{};  // 95 % of it, by Student's t over the units
  double t_p = 1;         // two-sided p of Student's paired t test

  static void Fields(auto& self, auto&& field) {
    field("pairs", self.pairs);
    field("seeds", self.seeds);
    field("mean", self.mean);
    field("confidence_95", self.confidence);
    field("t_p", self.t_p);
  }
};
PairedComparison ComparePairs(const std::vector<double>& a, const std::vector<double>& b,
                              const std::vector<int64_t>& units = {});

// McNemar's exact test, two-sided: of pairs in which exactly one of both succeeded, `only_a` and
// `only_b` times. It is the sign test, too: that a difference is as likely up as down.
double McNemarExactP(int64_t only_a, int64_t only_b);

// The same where pairs belong together: `sums` has, of each unit, its pairs that are up less those
// that are down; whether all of a unit's are the other way round is as likely. Exact, by normal
// approximation only where more than 1,000 units of unequal size differ.
double SignFlipP(const std::vector<int64_t>& sums);

// What a comparison of this size could have shown: the least difference of two success rates for
// which McNemar's exact test has p <= `level` with a probability of `power`, on so many pairs of
// which the share `differing` has another outcome by chance alone, as often one way as the other.
// Nothing where no difference would do. Of two sets on other seeds whose rate is p, 2 p (1 - p)
// differ by chance.
std::optional<double> LeastDifferenceSeen(int64_t pairs, double differing, double power = 0.8,
                                          double level = 0.05);

// 95 % interval of the difference of the success rates, b's less a's, of so many pairs of which
// `only_a` and `only_b` succeeded in one alone: Wald's with half a pair added to each cell (Agresti
// and Min, Stat. Med. 24 (2005) 729).
// Counts are fractions where they are divided by a cluster effect.
Interval RateDifferenceInterval(double only_a, double only_b, double pairs);

// Which of several tests are significant together: with a probability of at most `level` any of
// them is where nothing differs (Holm, Scand. J. Stat. 6 (1979) 65).
std::vector<bool> HolmSignificant(const std::vector<double>& p_values, double level = 0.05);

}  // namespace turbidock::statistics
