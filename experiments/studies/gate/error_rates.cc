#include "experiments/studies/gate/error_rates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "experiments/media/gnuplot.h"
#include "experiments/studies/gate/judge.h"
#include "sim/base/random.h"

namespace turbidock::gate {
namespace {

// One trial of each build.
struct OutcomePair {
  bool old_docked, new_docked;
};

OutcomePair Draw(const ErrorRateSetting& setting, Rng* rng) {
  const bool old_docked = rng->Uniform() < setting.old_rate;
  const double u = rng->Uniform();
  if (setting.coupling != Coupling::kIdentical) return {old_docked, u < setting.new_rate};
  // what docked is lost with the probability that gives the new rate
  const double kept = setting.new_rate / setting.old_rate;
  return {old_docked, old_docked && u < kept};
}

std::optional<statistics::Verdict> Decide(const statistics::RateTest& rate,
                                          const statistics::PairedRateTest& paired,
                                          Coupling coupling, int trials, int successes, int losses,
                                          int gains) {
  return coupling == Coupling::kOneSample ? rate.Decide(trials, successes)
                                          : paired.Decide(trials, losses, gains);
}

}  // namespace

ErrorRates SimulateSequences(const ErrorRateSetting& setting,
                             const statistics::RateTestDesign& design, int64_t sequences,
                             uint64_t seed) {
  const statistics::RateTest rate(design);
  const statistics::PairedRateTest paired(design.no_worse - design.worse, design.alpha, design.beta,
                                          design.max_trials);
  ErrorRates rates{.setting = setting, .sequences = sequences};
  Rng rng = SeedTree(seed).Stream("gate.error_rates");
  int64_t all_trials = 0;
  for (int64_t s = 0; s < sequences; ++s) {
    int trials = 0, successes = 0, losses = 0, gains = 0;
    std::optional<statistics::Verdict> verdict;
    while (!verdict && trials < design.max_trials) {
      const auto [old_docked, new_docked] = Draw(setting, &rng);
      ++trials;
      successes += new_docked;
      losses += old_docked && !new_docked;
      gains += !old_docked && new_docked;
      verdict = Decide(rate, paired, setting.coupling, trials, successes, losses, gains);
    }
    rates.failed += verdict == statistics::Verdict::kFail;
    rates.passed += verdict == statistics::Verdict::kPass;
    all_trials += trials;
  }
  rates.mean_trials = static_cast<double>(all_trials) / static_cast<double>(sequences);
  return rates;
}

std::vector<ErrorRateSetting> StatedSettings(const statistics::RateTestDesign& design) {
  std::vector<ErrorRateSetting> settings;
  for (const auto& [coupling, name] : EnumNames<Coupling>::kNames)
    for (const double new_rate : {design.no_worse, design.worse})
      settings.push_back({.coupling = coupling, .old_rate = design.no_worse, .new_rate = new_rate});
  return settings;
}

double WriteErrorRateFigure(const std::string& path, const statistics::RateTestDesign& design,
                            int64_t sequences, uint64_t seed) {
  const statistics::RateTest test(design);
  const statistics::FixedTest fixed = statistics::FixedSampleTest(design);
  const double margin = design.no_worse - design.worse;
  const double from = std::max(0.01, design.worse - margin);
  const double to = std::min(0.999, design.no_worse + margin);

  media::GnuplotScript script;
  script.BeginData("exact");
  constexpr int kCurvePoints = 200, kSimulatedPoints = 16;
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double p = from + (to - from) * i / kCurvePoints;
    const statistics::RateTest::Characteristic c = test.At(p);
    script.Row({p, c.p_fail, c.p_pass, c.p_inconclusive, c.expected_trials});
  }
  script.EndData().BeginData("counted");
  double worst = 0;
  for (int i = 0; i <= kSimulatedPoints; ++i) {
    const double p = from + (to - from) * i / kSimulatedPoints;
    const ErrorRates rates =
        SimulateSequences({.old_rate = design.no_worse, .new_rate = p}, design, sequences, seed);
    const statistics::RateTest::Characteristic c = test.At(p);
    const auto deviations = [&](double counted, double exact) {
      const double deviation = std::sqrt(exact * (1 - exact) / static_cast<double>(sequences));
      return deviation > 0 ? std::abs(counted - exact) / deviation : 0;
    };
    worst = std::max(
        {worst, deviations(rates.fail_rate(), c.p_fail), deviations(rates.pass_rate(), c.p_pass)});
    script.Row({p, rates.fail_rate(), rates.pass_rate(), 1 - rates.fail_rate() - rates.pass_rate(),
                rates.mean_trials});
  }
  script.EndData();
  script.Line(
      "set multiplot layout 1,2 title " +
      media::GnuplotQuoted(fmt::format(
          "Gate: {:g} against {:g}, alpha {:g}, beta {:g}, at most {} trials; points: {} "
          "simulated sequences each",
          design.no_worse, design.worse, design.alpha, design.beta, design.max_trials, sequences)));
  script.Line("set grid; set xlabel 'true success rate'; set key left center opaque");
  script.Line(fmt::format("set xrange [{}:{}]", from, to));
  for (const double p : {design.worse, design.no_worse})
    script.Line(fmt::format(
        "set arrow from {0}, graph 0 to {0}, graph 1 nohead dashtype 3 linecolor 'grey40'", p));
  script.Line("set yrange [0:1]; set ylabel 'probability of the verdict'");
  script.Line(
      "plot $exact using 1:2 with lines linecolor 'red' title 'fail', "
      "$exact using 1:3 with lines linecolor 'web-green' title 'pass', "
      "$exact using 1:4 with lines linecolor 'grey50' title 'inconclusive', "
      "$counted using 1:2 with points pointtype 7 linecolor 'red' notitle, "
      "$counted using 1:3 with points pointtype 7 linecolor 'web-green' notitle, "
      "$counted using 1:4 with points pointtype 7 linecolor 'grey50' notitle");
  script.Line("set yrange [0:*]; set ylabel 'trials'; set key bottom center opaque");
  script.Line(
      fmt::format("plot $exact using 1:5 with lines linecolor 'blue' title 'expected, sequential', "
                  "$counted using 1:5 with points pointtype 7 linecolor 'blue' notitle, "
                  "{} with lines dashtype 2 linecolor 'black' title 'test of fixed size'",
                  fixed.trials));
  script.Line("unset multiplot");
  script.WritePng(path, 1400, 600);
  return worst;
}

}  // namespace turbidock::gate
