#include "experiments/studies/gate/error_rates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "experiments/media/figure.h"
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
      verdict = setting.coupling == Coupling::kOneSample ? rate.Decide(trials, successes)
                                                         : paired.Decide(trials, losses, gains);
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

  using Characteristic = statistics::RateTest::Characteristic;
  std::vector<std::pair<double, Characteristic>> exact, counted;  // over the true rate
  for (const double p : report::Evenly(from, to, 200)) exact.emplace_back(p, test.At(p));
  double worst = 0;
  for (const double p : report::Evenly(from, to, 16)) {
    const ErrorRates rates =
        SimulateSequences({.old_rate = design.no_worse, .new_rate = p}, design, sequences, seed);
    const Characteristic c = test.At(p);
    const auto deviations = [&](double rate, double expected) {
      const double deviation =
          std::sqrt(expected * (1 - expected) / static_cast<double>(sequences));
      return deviation > 0 ? std::abs(rate - expected) / deviation : 0;
    };
    const double fail = rates.fail_rate(), pass = rates.pass_rate();
    worst = std::max({worst, deviations(fail, c.p_fail), deviations(pass, c.p_pass)});
    counted.push_back({p, {fail, pass, 1 - fail - pass, rates.mean_trials}});
  }

  report::Panel verdicts{
      .x = {"true success rate", from, to},
      .y = {"probability of the verdict", 0, 1},
      .rules = {{.at = design.worse, .is_up = true}, {.at = design.no_worse, .is_up = true}},
      .legend = report::Legend::kAbove};
  report::Panel trials = verdicts;
  trials.y = {"trials", 0};
  trials.rules.push_back({static_cast<double>(fixed.trials), "test of fixed size", {0, 0, 0}});
  const auto draw = [&](report::Panel* panel, const char* name, const Rgb& color,
                        double Characteristic::*value) {
    const auto point = [&](const auto& at) { return report::Sample{at.first, at.second.*value}; };
    panel->series.push_back({name, report::SamplesOf(exact, point), color});
    panel->series.push_back({"", report::SamplesOf(counted, point), color, report::Mark::kDots});
  };
  draw(&verdicts, "fail", report::CurveColor(1), &Characteristic::p_fail);
  draw(&verdicts, "pass", report::CurveColor(2), &Characteristic::p_pass);
  draw(&verdicts, "inconclusive", report::kGrey, &Characteristic::p_inconclusive);
  draw(&trials, "expected, sequential", report::CurveColor(0), &Characteristic::expected_trials);
  const std::string title = fmt::format(
      "Gate: {:g} against {:g}, alpha {:g}, beta {:g}, at most {} trials; points: {} simulated "
      "sequences each",
      design.no_worse, design.worse, design.alpha, design.beta, design.max_trials, sequences);
  media::WriteFigure(path, {.title = title,
                            .columns = 2,
                            .width_px = 700,
                            .height_px = 600,
                            .panels = {verdicts, trials}});
  return worst;
}

}  // namespace turbidock::gate
