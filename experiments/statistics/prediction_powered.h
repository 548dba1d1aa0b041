#pragma once
// The real success rate from few real trials and many simulated ones of the same conditions.
//
// Prediction-powered inference (Angelopoulos, Bates, Fannjiang, Jordan and Zrnic, Science 382
// (2023) 669) with power tuning (PPI++: Angelopoulos, Duchi and Zrnic, arXiv:2311.01453): an
// estimate of real trials alone, less what a predictor explains of its variance. Here the predictor
// is a condition's simulated success rate.
//
// TARGET. The mean of the conditions' real success rates, each weighted by its share of the real
// trials. Which conditions were tried and how often is taken as it is: nobody draws sea states by
// lot, and of a condition without real trials nothing is claimed. Real trials of a condition are
// independent and have its rate. Then the estimate is the real share of successes whatever the
// simulator says: PPI's correction of the mean is zero with these weights.
//
// GAIN. What differs between conditions is no chance with this target, and what the simulator
// explains of it no longer counts as variance. What happens within a condition it cannot explain,
// as it predicts the same for all its trials. So the interval is narrower only where conditions
// differ much; below what chance does within them no method gets that holds with a wrong simulator.
//
// COVERAGE does not hang on the simulator: a wrong one only explains less. Exact, over all outcomes
// (tests/statistics/prediction_powered_oracle_test.cc), for 2 to 6 conditions, equal and unequal
// numbers of trials, mean real rates of 0.5 to 0.99, log-odds of conditions up to so far from their
// middle; a simulator that is right, off by -0.2 to 0.2, in the wrong order, or says 0.3 and 0.95.
//
//   real    coverage      Wilson's  half width over Wilson's, simulator right: median (least)
//   trials  mean   least  least     +-0          +-1          +-2          +-4
//   6       0.977  0.912  0.826     1.04 (1.00)  1.01 (1.00)  1.00 (0.99)  1.00 (0.86)
//   12      0.975  0.914  0.885     1.00 (1.00)  1.00 (0.94)  1.00 (0.82)  0.98 (0.71)
//   30      0.960  0.930  0.930     1.00 (1.00)  0.98 (0.92)  0.96 (0.73)  0.93 (0.49)
//
// With 4 trials the least is 0.875, where the rate is one half; Wilson's is the same there.

#include <span>

#include "experiments/statistics/intervals.h"

namespace turbidock::statistics {

// A condition's trials; some real ones have some simulated ones.
struct RealAndSimulated {
  Count real, simulated;
};

struct RealRate {
  double rate = 0;            // of the real trials
  Interval interval{};        // 95 %
  double simulated_rate = 0;  // of the same conditions, weighted as the real ones
  double power = 0;           // PPI++'s lambda in [0, 1]: how far the simulator's differences count
  double worth_trials = 0;    // without a simulator, as many would tell as much
};
// Wilson's interval of that many trials (RateInterval). What is explained is found with two
// successes and two failures added over all conditions (Agresti and Coull, Am. Stat. 52 (1998)
// 119), so that a few trials that happen to go as predicted do not end all doubt. With one or two
// failures the upper end is at least a Poisson count's, as is the lower with one or two successes:
// Wilson's alone often misses there (Brown, Cai and DasGupta, Stat. Sci. 16 (2001) 101).
RealRate PredictRealRate(std::span<const RealAndSimulated> conditions);

// Two-sided p of "in each of these conditions the real success rate is the simulated one": the
// number of real successes in all, given how many of each condition's trials succeeded in both
// (exact; of one condition, Fisher's test). For single conditions ask one by one and use
// HolmSignificant. Of conditions with rates of 0.95, 0.9 and 0.8 and a simulator that is off by 0.2
// in each, p < 0.05 in 0 % of 6 trials, 22 % of 12, 73 % of 30; by 0.4: 47 %, 85 %, 100 %.
double RealDiffersP(std::span<const RealAndSimulated> conditions);

}  // namespace turbidock::statistics
