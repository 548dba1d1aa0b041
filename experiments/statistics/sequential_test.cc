#include "experiments/statistics/sequential_test.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::statistics {
namespace {

constexpr double kSpentShare = 0.9;    // of a level; see SignTest
constexpr double kNegligible = 1e-18;  // probability of paths that need not be followed
constexpr int kMaxTrials = 1 << 14;

bool IsProbability(double p) { return p > 0 && p < 1; }

// The probability of reaching the border where each trial is a hit or none, as likely.
double RateOfReaching(const std::vector<int>& least_hits) {
  std::vector<double> paths(least_hits.size(), 0.0);  // by hits so far, of those that go on
  paths[0] = 1;
  double rate = 0;
  size_t low = 0, high = 0;  // hits of the paths that are left
  for (size_t n = 1; n < least_hits.size(); ++n) {
    for (size_t hits = ++high; hits > low; --hits)
      paths[hits] = (paths[hits] + paths[hits - 1]) / 2;
    paths[low] /= 2;
    for (; high >= static_cast<size_t>(least_hits[n]) && high > low; --high)
      rate += std::exchange(paths[high], 0.0);
    while (low < high && paths[low] < kNegligible) paths[low++] = 0;
    while (low < high && paths[high] < kNegligible) paths[high--] = 0;
  }
  return rate;
}

// By trials, the fewest hits whose log likelihood ratio reaches the threshold.
std::vector<int> HitsToReach(double log_threshold, int max_trials) {
  const double hit = std::log(0.75 / 0.5), miss = std::log(0.25 / 0.5);
  std::vector<int> least_hits;
  for (int n = 0; n <= max_trials; ++n) {
    const double least = std::ceil((log_threshold - n * miss) / (hit - miss));
    least_hits.push_back(static_cast<int>(std::clamp(least, 0.0, n + 1.0)));
  }
  return least_hits;
}

}  // namespace

SignTest::SignTest(double level, int max_trials) {
  TD_CHECK(IsProbability(level) && max_trials >= 1 && max_trials <= kMaxTrials,
           "a test's design is impossible");
  // Wald's bound 1 / level is always enough; bisection finds the least threshold that is.
  double too_low = 0, enough = -std::log(level * kSpentShare) * (1 + 1e-9);
  constexpr int kHalvings = 30;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (too_low + enough) / 2;
    const double rate = RateOfReaching(HitsToReach(middle, max_trials));
    (rate <= kSpentShare * level ? enough : too_low) = middle;
  }
  least_hits_ = HitsToReach(enough, max_trials);
}

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
  double wealth = 0;  // of what rejects
  for (const Stake& stake : stakes_) wealth += std::exp(log_of(stake) - log_threshold_);
  return wealth >= 1;
}

}  // namespace turbidock::statistics
