#pragma once
// One measure of two sets of trials, pair by pair: how much it differs, how sure that is and, where
// a change for the worse matters from a margin on, the verdict as soon as it is known.
//
// A rate is of all pairs, each of which succeeded or failed on either side; a median is of pairs
// that have the number on both. Of the pairs that differ some are worse and some better: whether
// that is chance says the sign test, which is McNemar's test for a rate.
//
// A verdict is two sequential one-sided tests (sequential_test.h). "No worse" says that at most
// half of the pairs that differ are worse; what rejects that fails. "Worse by the margin" says of a
// rate that so much of it is lost (NetLossTest), of a median that at most half of the pairs are
// less than the margin worse; what rejects that passes. Where beta exceeds alpha the second needs
// fewer pairs: what makes every trial worse by less than the margin passes.

#include <cstdint>
#include <optional>
#include <vector>

#include "experiments/statistics/intervals.h"
#include "experiments/statistics/sequential_test.h"
#include "sim/base/result_fields.h"

namespace turbidock::statistics {

enum class MeasureKind { kRate, kMedian };

struct PairedDesign {
  double margin = 0;  // above 0, of a rate below 1
  double alpha = 0.05, beta = 0.05;
  int most = 100;  // pairs
};

struct PairedResult {
  int64_t pairs = 0, worse = 0, better = 0;
  int64_t seeds = 0;                      // of the pairs
  std::optional<double> a{}, b{};         // rate or median
  std::optional<double> difference{};     // b less a; of a median the median of the pairs'
  std::optional<Interval> interval_95{};  // of the difference, as if pairs had not been looked at;
                                          // 0 is in it unless the test excludes it
  double p_value = 1;                     // two-sided, exact; likewise
  double cluster_effect = 1;              // of the pairs' differences: 1 where seeds differ
  std::optional<double> margin{};         // these three where there is a design
  std::optional<Verdict> verdict{};
  std::optional<int64_t> decided_after{};

  TURBIDOCK_FIELDS(pairs, worse, better, seeds, a, b, difference, interval_95, p_value,
                   cluster_effect, margin, verdict, decided_after)
};

class PairedMeasure {
 public:
  // `worse`: the sign of a change for the worse. Without a design there is no verdict.
  PairedMeasure(MeasureKind kind, double worse, const std::optional<PairedDesign>& design = {});

  // The next pair; of a rate 1 is a success. `after`: what decided_after counts. `unit`: its seed;
  // pairs of the same one are alike, which the result allows for and a verdict does not.
  void Add(double a, double b, int64_t after, int64_t unit);
  bool is_judged() const { return fail_.has_value(); }  // has a design
  // Nothing while both verdicts are possible, and without a design.
  std::optional<Verdict> verdict() const { return verdict_; }
  PairedResult Result() const;

 private:
  MeasureKind kind_;
  double worse_sign_, margin_ = 0;
  std::optional<SignTest> fail_, pass_median_;
  std::optional<NetLossTest> pass_rate_;
  std::vector<double> a_, b_, differences_;
  std::vector<int64_t> units_;
  int worse_ = 0, better_ = 0, within_margin_ = 0;
  std::optional<Verdict> verdict_;
  std::optional<int64_t> decided_after_;
};

// How often a rate's test fails what does as before but for this share of the pairs, which it
// loses. Exact.
double FailRate(const PairedDesign& design, double loss);
// The least such loss that fails with this probability, if there is one.
std::optional<double> LeastLossSeen(const PairedDesign& design, double power);

}  // namespace turbidock::statistics
