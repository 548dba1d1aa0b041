#include "experiments/studies/gate/gate_size.h"

#include <fmt/format.h>

#include <algorithm>

#include "experiments/report/table.h"
#include "experiments/studies/gate/gate_plan.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

using report::Fixed;
using report::Panel;
using statistics::PairedRateTest;

constexpr double kUndecided = 0.01;  // at the last trial
constexpr int kFewestTrials = 16;    // at most, of a condition

PairedRateTest TestOf(const GateSize& size) {
  return {size.no_worse - size.worse, size.alpha, size.beta, size.max_trials};
}

SizeRow RowOf(const PairedRateTest& test, Coupling coupling, double old_rate, double new_rate) {
  const auto [loss, gain] = SharesOf(coupling, old_rate, new_rate);
  const statistics::Characteristic c = test.At(loss, gain);
  return {coupling, new_rate, c.p_fail, c.p_pass, c.p_inconclusive, c.expected_trials};
}

// Curves of a build that does the same but for what it loses, dots of an independent one.
report::Section Curves(const GateSize& size) {
  const double margin = size.no_worse - size.worse;
  const PairedRateTest test = TestOf(size);
  std::vector<SizeRow> curve, dots;
  for (const double rate : report::Evenly(std::max(0.01, size.worse - margin), size.no_worse, 60))
    curve.push_back(RowOf(test, Coupling::kIdentical, size.no_worse, rate));
  for (const SizeRow& row : size.exact)
    if (row.coupling == Coupling::kIndependent) dots.push_back(row);

  Panel verdicts{.title = "Verdicts",
                 .x = {.label = "success rate of the new build"},
                 .y = {"probability", 0, 1},
                 .rules = {{.at = size.worse, .is_up = true}}};
  Panel trials{.title = "Trials",
               .x = verdicts.x,
               .y = {.label = "expected trials", .low = 0},
               .rules = verdicts.rules};
  const auto draw = [&](Panel* panel, const char* name, const Rgb& color, double SizeRow::*value) {
    panel->series.push_back({name, report::SamplesOf(curve, &SizeRow::new_rate, value), color});
    panel->series.push_back(
        {"", report::SamplesOf(dots, &SizeRow::new_rate, value), color, report::Mark::kDots});
  };
  draw(&verdicts, "fail", report::CurveColor(1), &SizeRow::fail);
  draw(&verdicts, "pass", report::CurveColor(2), &SizeRow::pass);
  draw(&verdicts, "inconclusive", report::kGrey, &SizeRow::inconclusive);
  draw(&trials, "expected trials", report::CurveColor(0), &SizeRow::expected_trials);
  return {.title = "Over the new build's success rate",
          .note =
              "Lines: a build that does as the old one but for what it loses. Dots: one whose "
              "trials have nothing to do with the old one's.",
          .panels = {verdicts, trials},
          .wide = true};
}

}  // namespace

PairShares SharesOf(Coupling coupling, double old_rate, double new_rate) {
  if (coupling == Coupling::kIdentical) return {.loss = std::max(0.0, old_rate - new_rate)};
  return {.loss = old_rate * (1 - new_rate), .gain = (1 - old_rate) * new_rate};
}

int TrialsToDecide(double margin, double alpha, double beta, double loss, int limit) {
  const auto undecided = [&](int trials) {
    const PairedRateTest test(margin, alpha, beta, trials);
    return std::max(test.At(0).p_inconclusive, test.At(loss).p_inconclusive);
  };
  int trials = std::min(kFewestTrials, limit);
  while (trials < limit && undecided(trials) > kUndecided)
    trials = std::min(limit, trials + std::max(4, trials / 4));
  return trials;
}

GateSize SizeOf(const SizeDesign& design) {
  const double margin = design.no_worse - design.worse;
  GateSize size{.no_worse = design.no_worse,
                .worse = design.worse,
                .alpha = design.alpha,
                .beta = design.beta,
                .exact = {}};
  // the shorter question first: an unchanged build passes soonest
  if (PairedRateTest(margin, design.alpha, design.beta, kMaxTrials).FewestPairs() < kMaxTrials)
    size.max_trials = TrialsToDecide(margin, design.alpha, design.beta, margin, kMaxTrials);
  if (size.max_trials == 0 || size.max_trials == kMaxTrials)
    throw ConfigError(fmt::format(
        "that takes more than {} trials; give a larger margin or error rates", kMaxTrials));
  const PairedRateTest test = TestOf(size);
  for (const auto& [coupling, name] : EnumNames<Coupling>::kNames)
    for (const double rate : {design.no_worse, (design.no_worse + design.worse) / 2, design.worse})
      size.exact.push_back(RowOf(test, coupling, size.no_worse, rate));
  return size;
}

report::Report ReportOf(const GateSize& size) {
  report::Table table(
      {"<trials of both builds", "new rate", "fail", "pass", "inconclusive", "trials"});
  for (const SizeRow& row : size.exact)
    table.Row({NameOf(row.coupling), fmt::format("{:.4g}", row.new_rate), Fixed(row.fail, 4),
               Fixed(row.pass, 4), Fixed(row.inconclusive, 4), Fixed(row.expected_trials, 1)});
  return {.kind = "gate_plan_size",
          .title = fmt::format("trials of a gate: success rate {:g} against {:g}", size.no_worse,
                               size.worse),
          .facts = {{"trials at most", std::to_string(size.max_trials),
                     "of a condition; leave 1 % undecided"},
                    {"alpha", fmt::format("{:g}", size.alpha), "of this test alone"},
                    {"beta", fmt::format("{:g}", size.beta)}},
          .sections = {{.title = "Verdicts",
                        .note = "Identical: the new build does as the old one, but for what it "
                                "loses. Independent: their trials have nothing to do with each "
                                "other.",
                        .table = table},
                       Curves(size)}};
}

}  // namespace turbidock::gate
