#pragma once
// Sequential tests that stop as soon as they know, with error rates that hold exactly.
//
// The question "is it worse?" is two one-sided tests on the same trials. One rejects "no worse": it
// fails the gate, wrongly with probability alpha at most. The other rejects "worse by the margin":
// it passes the gate, wrongly with probability beta at most. Whichever rejects first decides; when
// neither has by the last trial allowed, the gate is inconclusive. Stopping by one test can only
// take rejections from the other, so each guarantee holds whatever the other does.
//
// Sources: A. Wald, Sequential Analysis, Wiley 1947 (likelihood ratio tests, ch. 3; discordant
// pairs of two dichotomies, ch. 6). J. Ville, Etude critique de la notion de collectif, 1939 (the
// bound on a martingale's maximum). I. Waudby-Smith and A. Ramdas, "Estimating means of bounded
// random variables by betting", J. R. Stat. Soc. B 86 (2024) 1-27.

#include <optional>
#include <vector>

#include "sim/base/fields.h"

namespace turbidock::statistics {

// What people may ask of these tests: levels, rates and margins of at least so much, and as far
// from 1. The sums over all paths leave out what is far less likely.
inline constexpr double kLeastProbability = 1e-6;

// Rejects "a hit has probability p_null or less" in favour of more hits, looking after every trial.
//
// It rejects as soon as Wald's likelihood ratio of p_alternative to p_null reaches a threshold. The
// threshold is the least for which the probability of ever rejecting within max_trials trials,
// summed exactly over all paths of hits under p_null, stays below `level`: neither Wald's
// approximation nor the end of the trials costs anything. Nine tenths of the level are spent, so
// that the rate counted in some thousand simulated sequences does not exceed it by chance either.
class HitTest {
 public:
  struct Design {
    double p_null = 0.5, p_alternative = 0.75;  // 0 < p_null < p_alternative < 1
    double level = 0.05;                        // in (0, 1)
    int max_trials = 100;                       // at least 1
  };
  explicit HitTest(const Design& design);

  bool Rejects(int trials, int hits) const {
    return hits >= least_hits_[static_cast<size_t>(trials)];
  }
  // The fewest hits that reject after so many trials; more than there are trials when none do.
  int least_hits(int trials) const { return least_hits_[static_cast<size_t>(trials)]; }
  int max_trials() const { return static_cast<int>(least_hits_.size()) - 1; }
  // Probability to reject within max_trials when a hit has probability p.
  double RejectionRate(double p) const;

 private:
  std::vector<int> least_hits_;  // by trials, from 0
};

// The design of a sign test: "at most half are hits", sharpest when three in four are.
inline HitTest SignTest(double level, int max_trials) {
  return HitTest({.p_null = 0.5, .p_alternative = 0.75, .level = level, .max_trials = max_trials});
}

// Rejects "the new build loses `margin` or more of the success rate" on pairs of trials of the same
// seeds, of which `losses` docked before and no longer do, `gains` the other way round. No
// assumption on how the two builds' outcomes go together.
//
// With Z = loss - gain in {-1, 0, 1} the null says E[Z] >= margin. Then the product of 1 + b
// (margin - Z) is a supermartingale for any stake b in [0, 1 / (1 - margin)], and so is an average
// over stakes; by Ville it ever reaches 1 / level with probability `level` at most.
class NetLossTest {
 public:
  NetLossTest(double margin, double level);  // both in (0, 1)

  bool Rejects(int pairs, int losses, int gains) const;

 private:
  struct Stake {
    double log_weight, log_same, log_loss, log_gain;
  };
  std::vector<Stake> stakes_;
  double log_threshold_;
};

// ------------------------------------------------------------------------- two tests, one verdict

enum class Verdict { kFail, kInconclusive, kPass };  // the worst first
constexpr auto Names(Verdict) {
  using enum Verdict;
  return EnumList<Verdict>({{kPass, "pass"}, {kFail, "fail"}, {kInconclusive, "inconclusive"}});
}

// How often a test comes to which verdict, exactly, and after how many trials.
struct Characteristic {
  double p_fail = 0, p_pass = 0, p_inconclusive = 0;
  double expected_trials = 0;
};

// Success rates of two builds on the same seeds: fails when more than half of the pairs that differ
// are losses, passes when less than the margin is lost.
class PairedRateTest {
 public:
  PairedRateTest(double margin, double alpha, double beta, int max_pairs);

  // Nothing while both are possible.
  std::optional<Verdict> Decide(int pairs, int losses, int gains) const;
  // Of a build that loses and gains these shares of the pairs. One that does as the old build but
  // for what it loses gains none; where the builds' trials have nothing to do with each other, the
  // shares follow from both rates.
  Characteristic At(double loss, double gain = 0) const;
  // After which it passes a build that does the same; more than max_pairs when it never does.
  int FewestPairs() const;
  int max_pairs() const { return fail_.max_trials(); }

 private:
  HitTest fail_;
  NetLossTest pass_;
};

// A success rate that is no worse, and one that is worse by all that matters.
struct RateTestDesign {
  double no_worse = 0.95, worse = 0.85;  // 0 < worse < no_worse < 1
  double alpha = 0.05, beta = 0.05;      // in (0, 1)
  int max_trials = 200;                  // at least 1
};

// One-sample test of a success rate: fails when it is shown to be below `no_worse`, passes when it
// is shown to be above `worse`.
class RateTest {
 public:
  explicit RateTest(const RateTestDesign& design);

  // Nothing while both are possible.
  std::optional<Verdict> Decide(int trials, int successes) const;

 private:
  HitTest fail_, pass_;
};

}  // namespace turbidock::statistics
