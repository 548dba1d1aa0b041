#include "experiments/statistics/paired_measure.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "experiments/statistics/paired_tests.h"

namespace turbidock::statistics {
namespace {

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

PairedMeasure::PairedMeasure(MeasureKind kind, double worse,
                             const std::optional<PairedDesign>& design)
    : kind_(kind), worse_sign_(worse) {
  if (!design) return;
  margin_ = design->margin;
  fail_.emplace(design->alpha, design->most);
  if (kind == MeasureKind::kRate)
    pass_rate_.emplace(margin_, design->beta);
  else
    pass_median_.emplace(design->beta, design->most);
}

void PairedMeasure::Add(double a, double b, int64_t after, int64_t unit) {
  a_.push_back(a);
  b_.push_back(b);
  differences_.push_back(b - a);
  units_.push_back(unit);
  const double was = worse_sign_ * a, is = worse_sign_ * b;
  worse_ += is > was;
  better_ += is < was;
  within_margin_ += is < was + margin_;
  if (!fail_ || verdict_) return;
  const int pairs = static_cast<int>(std::ssize(a_));
  if (fail_->Rejects(worse_ + better_, worse_))
    verdict_ = Verdict::kFail;
  else if (pass_rate_ ? pass_rate_->Rejects(pairs, worse_, better_)
                      : pass_median_->Rejects(pairs, within_margin_))
    verdict_ = Verdict::kPass;
  if (verdict_) decided_after_ = after;
}

PairedResult PairedMeasure::Result() const {
  PairedResult result{.pairs = std::ssize(a_), .worse = worse_, .better = better_};
  if (fail_) {
    result.margin = margin_;
    result.verdict = verdict_.value_or(Verdict::kInconclusive);
    result.decided_after = decided_after_;
  }
  if (a_.empty()) return result;
  std::map<int64_t, int64_t> sums;  // pairs that are up less those that are down, by unit
  for (size_t i = 0; i < units_.size(); ++i)
    sums[units_[i]] += (differences_[i] > 0) - (differences_[i] < 0);
  std::vector<int64_t> of_units;
  of_units.reserve(sums.size());
  for (const auto& [unit, sum] : sums) of_units.push_back(sum);
  result.seeds = std::ssize(sums);
  result.p_value = SignFlipP(of_units);
  if (kind_ == MeasureKind::kMedian) {
    result.a = Median(a_);
    result.b = Median(b_);
    result.difference = Median(differences_);
    std::vector<double> above;
    for (const double difference : differences_)
      above.push_back(difference > *result.difference ? 1 : 0);
    result.cluster_effect = ClusterEffect(above, units_);
    result.interval_95 = MedianInterval(differences_, 0.95, result.cluster_effect);
  } else {
    const double effect = result.cluster_effect = ClusterEffect(differences_, units_);
    const auto [lost, gained] =
        worse_sign_ < 0 ? std::pair(worse_, better_) : std::pair(better_, worse_);
    result.a = Mean(a_);
    result.b = Mean(b_);
    result.difference = static_cast<double>(gained - lost) / static_cast<double>(a_.size());
    result.interval_95 = RateDifferenceInterval(lost / effect, gained / effect,
                                                static_cast<double>(a_.size()) / effect);
  }
  // The test is exact: the interval excludes no change only where it does.
  if (auto& interval = result.interval_95; interval && result.p_value > 0.05)
    interval = Interval{std::min(interval->low, 0.0), std::max(interval->high, 0.0)};
  return result;
}

namespace {

double FailRateOf(const SignTest& fail, const NetLossTest& pass, double loss) {
  constexpr double kNegligible = 1e-18;  // probability of paths that need not be followed
  std::vector<double> paths = {1.0};     // by losses so far, of those without a verdict
  double failed = 0;
  for (int pairs = 1; pairs <= fail.max_trials(); ++pairs) {
    paths.push_back(0);
    for (size_t losses = paths.size(); losses-- > 0;) {
      double& p = paths[losses];
      p = (1 - loss) * p + (losses > 0 ? loss * paths[losses - 1] : 0);
      if (p < kNegligible) p = 0;
      const int lost = static_cast<int>(losses);
      const bool fails = fail.Rejects(lost, lost);
      if (fails) failed += p;
      if (fails || pass.Rejects(pairs, lost, 0)) p = 0;
    }
  }
  return failed;
}

}  // namespace

double FailRate(const PairedDesign& design, double loss) {
  return FailRateOf({design.alpha, design.most}, {design.margin, design.beta}, loss);
}

std::optional<double> LeastLossSeen(const PairedDesign& design, double power) {
  const SignTest fail(design.alpha, design.most);
  const NetLossTest pass(design.margin, design.beta);
  return LeastReaching(power, [&](double loss) { return FailRateOf(fail, pass, loss); });
}

}  // namespace turbidock::statistics
