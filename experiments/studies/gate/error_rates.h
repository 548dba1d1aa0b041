#pragma once
// How many trials a gate needs and how often it errs: computed exactly where that is possible, and
// counted in simulated sequences of trials.

#include <cstdint>
#include <string>
#include <vector>

#include "experiments/statistics/sequential_test.h"
#include "sim/base/fields.h"

namespace turbidock::gate {

// How the trials of the old and the new build go together.
enum class Coupling {
  kOneSample,    // the old build's rate is known: RateTest
  kIndependent,  // pairs of seeds, but the builds' outcomes have nothing to do with each other
  kIdentical,    // pairs of seeds; the new build does as the old one, but for what it lost
};
constexpr auto Names(Coupling) {
  using enum Coupling;
  return EnumList<Coupling>({{kOneSample, "one_sample"},
                             {kIndependent, "paired_independent"},
                             {kIdentical, "paired_identical"}});
}

struct ErrorRateSetting {
  Coupling coupling = Coupling::kOneSample;
  double old_rate = 0.95, new_rate = 0.95;
};

// What happened in many sequences.
struct ErrorRates {
  ErrorRateSetting setting;
  int64_t sequences = 0, failed = 0, passed = 0;
  double mean_trials = 0;

  double fail_rate() const { return static_cast<double>(failed) / static_cast<double>(sequences); }
  double pass_rate() const { return static_cast<double>(passed) / static_cast<double>(sequences); }
};

// The tests of a gate's success rate, as the judge puts them together.
ErrorRates SimulateSequences(const ErrorRateSetting& setting,
                             const statistics::RateTestDesign& design, int64_t sequences,
                             uint64_t seed);

// The settings in which a design's error rates are stated: every coupling, at the rate that is no
// worse and at the one that is worse.
std::vector<ErrorRateSetting> StatedSettings(const statistics::RateTestDesign& design);

// Draws the exact verdict rates and expected trials of the one-sample test over the true rate, with
// simulated points and the test of fixed size, into a file. Returns the largest difference between
// a simulated and an exact verdict rate, in standard deviations.
double WriteErrorRateFigure(const std::string& path, const statistics::RateTestDesign& design,
                            int64_t sequences, uint64_t seed);

}  // namespace turbidock::gate
