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

#include <vector>

#include "sim/base/fields.h"

namespace turbidock::statistics {

// What people may ask of these tests: levels, rates and margins of at least so much, and as far
// from 1. The sums over all paths leave out what is far less likely.
inline constexpr double kLeastProbability = 1e-6;

// Rejects "at most half are hits" in favour of more hits, looking after every one: the sign test.
//
// It rejects as soon as Wald's likelihood ratio of three hits in four to one in two reaches a
// threshold. The threshold is the least for which the probability of ever rejecting within
// max_trials trials, summed exactly over all paths of fair hits, stays below `level`: neither
// Wald's approximation nor the end of the trials costs anything. Nine tenths of the level are
// spent, so that the rate counted in some thousand simulated sequences does not exceed it by chance
// either.
class SignTest {
 public:
  SignTest(double level, int max_trials);  // level in (0, 1), a trial at least

  bool Rejects(int trials, int hits) const {
    return hits >= least_hits_[static_cast<size_t>(trials)];
  }
  int max_trials() const { return static_cast<int>(least_hits_.size()) - 1; }

 private:
  std::vector<int> least_hits_;  // that reject, by trials from 0; more than these when none do
};

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

}  // namespace turbidock::statistics
