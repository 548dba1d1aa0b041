#pragma once
// Trials of two builds, drawn by chance and judged one after another: how often a test of the
// success rate comes to which verdict.

#include <cstdint>
#include <functional>
#include <optional>

#include "experiments/statistics/sequential_test.h"
#include "experiments/studies/gate/gate_size.h"
#include "sim/base/random.h"

namespace turbidock::gate {

// How often in many sequences.
struct Counted {
  double fail = 0, pass = 0, mean_trials = 0;
};

// The verdict after so many trials, of which the new build docked in `successes`.
using Decide = std::function<std::optional<statistics::Verdict>(int trials, int successes,
                                                                int losses, int gains)>;

inline Counted CountSequences(Coupling coupling, double old_rate, double new_rate, int max_trials,
                              int sequences, uint64_t seed, const Decide& decide) {
  Rng rng = SeedTree(seed).Stream("gate.sequences");
  Counted counted;
  for (int s = 0; s < sequences; ++s) {
    int trials = 0, successes = 0, losses = 0, gains = 0;
    std::optional<statistics::Verdict> verdict;
    while (!verdict && trials < max_trials) {
      const bool was = rng.Uniform() < old_rate;
      const double u = rng.Uniform();
      // of identical builds the new one loses what docked with the probability that gives its rate
      const bool is =
          coupling == Coupling::kIndependent ? u < new_rate : was && u < new_rate / old_rate;
      ++trials;
      successes += is;
      losses += was && !is;
      gains += !was && is;
      verdict = decide(trials, successes, losses, gains);
    }
    counted.fail += verdict == statistics::Verdict::kFail;
    counted.pass += verdict == statistics::Verdict::kPass;
    counted.mean_trials += trials;
  }
  for (double* share : {&counted.fail, &counted.pass, &counted.mean_trials}) *share /= sequences;
  return counted;
}

inline Counted CountPairs(const statistics::PairedRateTest& test, Coupling coupling,
                          double old_rate, double new_rate, int sequences, uint64_t seed) {
  return CountSequences(
      coupling, old_rate, new_rate, test.max_pairs(), sequences, seed,
      [&](int trials, int, int losses, int gains) { return test.Decide(trials, losses, gains); });
}

}  // namespace turbidock::gate
