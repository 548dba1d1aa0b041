#include "experiments/statistics/sequential_test.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::statistics {
namespace {

constexpr double kSpentShare = 0.9;    // of a level; see HitTest
constexpr double kNegligible = 1e-18;  // probability of paths that need not be followed
constexpr int kMaxTrials = 1 << 14;

bool IsProbability(double p) { return p > 0 && p < 1; }

// log(exp(a) + exp(b))
double LogAdd(double a, double b) {
  if (a < b) std::swap(a, b);
  return std::isinf(a) ? a : a + std::log1p(std::exp(b - a));
}

// Number of hits so far, as probabilities: one trial after another, paths that leave are taken out.
class HitWalk {
 public:
  HitWalk(int max_trials, double p)
      : p_(p), probability_(static_cast<size_t>(max_trials) + 1, 0.0) {
    probability_[0] = 1;
  }

  void Step() {
    ++trials_;
    for (int hits = std::min(trials_, highest_ + 1); hits >= lowest_; --hits) {
      const double stay = hits <= highest_ ? At(hits) * (1 - p_) : 0;
      At(hits) = stay + (hits > lowest_ ? At(hits - 1) * p_ : 0);
    }
    highest_ = std::min(trials_, highest_ + 1);
    while (lowest_ < highest_ && At(lowest_) < kNegligible) ++lowest_;
    while (lowest_ < highest_ && At(highest_) < kNegligible) --highest_;
  }

  // Takes out the paths with that many hits or more; returns their share.
  double TakeFrom(int hits) {
    double taken = 0;
    for (; highest_ >= std::max(hits, lowest_); --highest_) taken += Clear(highest_);
    return taken;
  }

 private:
  double& At(int hits) { return probability_[static_cast<size_t>(hits)]; }
  double Clear(int hits) { return std::exchange(At(hits), 0.0); }

  double p_;
  std::vector<double> probability_;  // by hits
  int trials_ = 0;
  int lowest_ = 0, highest_ = 0;  // hits of the paths that are left
};

double RateOfReaching(const std::vector<int>& least_hits, double p) {
  const int max_trials = static_cast<int>(least_hits.size()) - 1;
  HitWalk walk(max_trials, p);
  double rate = 0;
  for (int n = 1; n <= max_trials; ++n) {
    walk.Step();
    rate += walk.TakeFrom(least_hits[static_cast<size_t>(n)]);
  }
  return rate;
}

// By trials, the fewest hits whose log likelihood ratio reaches the threshold.
std::vector<int> HitsToReach(const HitTest::Design& design, double log_threshold) {
  const double hit = std::log(design.p_alternative / design.p_null);
  const double miss = std::log((1 - design.p_alternative) / (1 - design.p_null));
  std::vector<int> least_hits(static_cast<size_t>(design.max_trials) + 1);
  for (int n = 0; n <= design.max_trials; ++n) {
    const double least = std::ceil((log_threshold - n * miss) / (hit - miss));
    least_hits[static_cast<size_t>(n)] = static_cast<int>(std::clamp(least, 0.0, n + 1.0));
  }
  return least_hits;
}

}  // namespace

HitTest::HitTest(const Design& design) {
  TD_CHECK(IsProbability(design.p_null) && IsProbability(design.p_alternative) &&
               design.p_null < design.p_alternative && IsProbability(design.level) &&
               design.max_trials >= 1 && design.max_trials <= kMaxTrials,
           "a test's design is impossible");
  // Wald's bound 1 / level is always enough; bisection finds the least threshold that is.
  double too_low = 0, enough = -std::log(design.level * kSpentShare) * (1 + 1e-9);
  constexpr int kHalvings = 30;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (too_low + enough) / 2;
    const double rate = RateOfReaching(HitsToReach(design, middle), design.p_null);
    (rate <= kSpentShare * design.level ? enough : too_low) = middle;
  }
  least_hits_ = HitsToReach(design, enough);
}

double HitTest::RejectionRate(double p) const { return RateOfReaching(least_hits_, p); }

NetLossTest::NetLossTest(double margin, double level) : log_threshold_(-std::log(level)) {
  TD_CHECK(IsProbability(margin) && IsProbability(level), "a test's design is impossible");
  // Shares of the largest stake and their weights. The largest is best when no pair differs, a
  // smaller one when the builds differ by chance in many pairs.
  constexpr std::array<std::array<double, 2>, 4> kStakes = {
      {{1, 0.4}, {0.7, 0.3}, {0.4, 0.2}, {0.2, 0.1}}};
  for (const auto& [share, weight] : kStakes) {
    const double b = share / (1 - margin);
    stakes_.push_back({.log_weight = std::log(weight),
                       .log_same = std::log1p(b * margin),
                       .log_loss = std::log(std::max(0.0, 1 - b * (1 - margin))),
                       .log_gain = std::log1p(b * (1 + margin))});
  }
}

bool NetLossTest::Rejects(int pairs, int losses, int gains) const {
  const auto log_of = [&](const Stake& stake) {
    const double lost = losses > 0 ? losses * stake.log_loss : 0;  // infinitely: broke
    return stake.log_weight + (pairs - losses - gains) * stake.log_same + lost +
           gains * stake.log_gain;
  };
  double largest = -std::numeric_limits<double>::infinity();
  for (const Stake& stake : stakes_) largest = std::max(largest, log_of(stake));
  // The sum of four is at least the largest and at most four times it: mostly that is enough.
  if (largest >= log_threshold_) return true;
  if (largest + 2 < log_threshold_) return false;
  double log_wealth = -std::numeric_limits<double>::infinity();
  for (const Stake& stake : stakes_) log_wealth = LogAdd(log_wealth, log_of(stake));
  return log_wealth >= log_threshold_;
}

PairedRateTest::PairedRateTest(double margin, double alpha, double beta, int max_pairs)
    : fail_(SignTest(alpha, max_pairs)), pass_(margin, beta) {}

std::optional<Verdict> PairedRateTest::Decide(int pairs, int losses, int gains) const {
  if (fail_.Rejects(losses + gains, losses)) return Verdict::kFail;
  if (pass_.Rejects(pairs, losses, gains)) return Verdict::kPass;
  return std::nullopt;
}

Characteristic PairedRateTest::At(double loss, double gain) const {
  // ways[losses][gains]: the probability of so many and no verdict yet
  std::vector<std::vector<double>> ways = {{1.0}};
  Characteristic result;
  result.p_inconclusive = 1;
  for (int pairs = 1; pairs <= max_pairs() && result.p_inconclusive > 0; ++pairs) {
    result.expected_trials += result.p_inconclusive;
    result.p_inconclusive = 0;
    const size_t gains = ways[0].size() + (gain > 0 ? 1 : 0);
    ways.emplace_back();
    for (std::vector<double>& row : ways) row.resize(gains, 0.0);
    size_t last_loss = 0, last_gain = 0;  // of those that count
    for (size_t l = ways.size(); l-- > 0;)
      for (size_t g = gains; g-- > 0;) {
        double& p = ways[l][g];
        p = (1 - loss - gain) * p + (l > 0 ? loss * ways[l - 1][g] : 0) +
            (g > 0 ? gain * ways[l][g - 1] : 0);
        if (p >= kNegligible)
          if (const auto verdict = Decide(pairs, static_cast<int>(l), static_cast<int>(g)))
            (verdict == Verdict::kFail ? result.p_fail : result.p_pass) += std::exchange(p, 0.0);
        if (p < kNegligible) continue;
        result.p_inconclusive += p;
        last_loss = std::max(last_loss, l);
        last_gain = std::max(last_gain, g);
      }
    ways.resize(last_loss + 1);
    for (std::vector<double>& row : ways) row.resize(last_gain + 1);
  }
  return result;
}

int PairedRateTest::FewestPairs() const {
  int pairs = 1;
  while (pairs <= max_pairs() && Decide(pairs, 0, 0) != Verdict::kPass) ++pairs;
  return pairs;
}

RateTest::RateTest(const RateTestDesign& d)
    : fail_({.p_null = 1 - d.no_worse,
             .p_alternative = 1 - d.worse,
             .level = d.alpha,
             .max_trials = d.max_trials}),
      pass_({.p_null = d.worse,
             .p_alternative = d.no_worse,
             .level = d.beta,
             .max_trials = d.max_trials}) {}

std::optional<Verdict> RateTest::Decide(int trials, int successes) const {
  if (fail_.Rejects(trials, trials - successes)) return Verdict::kFail;
  if (pass_.Rejects(trials, successes)) return Verdict::kPass;
  return std::nullopt;
}

}  // namespace turbidock::statistics
