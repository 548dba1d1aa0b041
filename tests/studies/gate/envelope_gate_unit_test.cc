// Gates on plans with ranges, on synthetic trials: the share of the ranges that was lost.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "experiments/report/report.h"
#include "experiments/system/output_path.h"
#include "tests/studies/gate/synthetic_gate.h"
#include "tests/support/message_of.h"

namespace turbidock::gate {
namespace {

using statistics::Verdict;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;

// Docks in a share of the range, calm or rough; the rate falls from 0.95 to 0.5 within a tenth of
// it. Trials of the same seed have the same luck, unless that is of another name.
Build DocksIn(double share, const std::string& luck = "docks") {
  return [share, luck](int64_t cell, int64_t seed) {
    const double place = static_cast<double>(cell % 41) / 40;
    const double odds = std::log(9) + 30 * (share - place);
    return Ended(seed, Noise(seed, luck).Uniform() < 1 / (1 + std::exp(-odds)));
  };
}

class EnvelopeGate : public testing::OwnFolder {
 protected:
  Gate Load(const std::string& margins = "{area: 0.05}", const std::string& keys = "",
            const std::string& ranges = kRanges, const std::vector<std::string>& given = {}) {
    return LoadGate(File("gate.yaml",
                         "schema_version: 1\nscenario: pool_active\n"
                         "cases: {calm: {}, rough: {sea.state: rough}}\n" +
                             ranges + "gate:\n  baseline: gate.baseline.yaml\n  margins: " +
                             margins + "\n" + keys),
                    {}, config::ParseAssignments(given));
  }
  static constexpr const char* kRanges =
      "ranges:\n  water.milk_ml_m3: {from: 0, to: 40, success: falls}\n"
      "find: {rate: 0.9, width: 0.1}\n";
};

TEST_F(EnvelopeGate, WhatDoesAsBeforePassesAndALossFails) {
  const Gate gate = Load();
  ASSERT_EQ(gate.conditions.size(), 2u);
  EXPECT_EQ(gate.conditions[0].name, "calm");
  const Baseline baseline = Measure(gate, DocksIn(0.6));
  const GateReport same = Judge(gate, baseline, DocksIn(0.6));
  const GateReport lost = Judge(gate, baseline, DocksIn(0.45));
  EXPECT_EQ(same.verdict, Verdict::kPass);
  EXPECT_EQ(lost.verdict, Verdict::kFail);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_LT(same.conditions[i].trials, baseline.conditions[i].trials) << "as soon as it is known";
    const batch::Change& area = lost.conditions[i].changes.at(1);
    EXPECT_EQ(area.measure, batch::kArea);
    EXPECT_NEAR(*area.a, 0.6, 0.06);
    EXPECT_LT(area.interval_95->low, -0.15);
    EXPECT_GT(area.interval_95->high, -0.15);
    EXPECT_LT(area.interval_95->high, 0);
    const batch::Change& success = lost.conditions[i].changes.at(0);
    const EnvelopeShift shift(gate.plan, baseline.conditions[i]);
    EXPECT_EQ(*area.difference, -shift.AreaLost(-*success.difference));
    EXPECT_EQ(*area.b, *area.a + *area.difference);
    EXPECT_EQ(*success.margin, shift.SuccessLost(0.05));
    EXPECT_EQ(lost.conditions[i].flips.size(), static_cast<size_t>(area.worse));
  }
}

TEST_F(EnvelopeGate, ALossOfOneConditionIsThatOnes) {
  const Gate gate = Load();
  const Build whole = DocksIn(0.6), less = DocksIn(0.4);
  const Baseline baseline = Measure(gate, whole);
  const GateReport report = Judge(gate, baseline, [&](int64_t cell, int64_t seed) {
    return (cell < 41 ? whole : less)(cell, seed);
  });
  EXPECT_EQ(report.conditions[0].verdict, Verdict::kPass);
  EXPECT_EQ(report.conditions[1].verdict, Verdict::kFail);
  const report::Report shown = ReportOf(report);
  const report::Section& both = SectionOf(shown, "Where success is 90 %: rough");
  EXPECT_THAT(both.lines.at(0), HasSubstr("baseline: 90 % up to water milk 2"));
  EXPECT_EQ(report.conditions[1].envelope["envelopes"][1]["name"], "now");
}

TEST_F(EnvelopeGate, NothingDependsOnWhichTrialEndsFirst) {
  const Gate gate = Load();
  GateRun one(gate), many(gate);
  Drive(gate, DocksIn(0.6), &one, 1);
  Drive(gate, DocksIn(0.6), &many, 9);
  const Baseline baseline = one.Measured();
  EXPECT_EQ(BaselineText(baseline), BaselineText(many.Measured()));
  EXPECT_EQ(JsonOf(Judge(gate, baseline, DocksIn(0.5), 1)),
            JsonOf(Judge(gate, baseline, DocksIn(0.5), 9)));
  system::WriteWhole(gate.settings.baseline, BaselineText(baseline));
  EXPECT_EQ(BaselineText(LoadBaseline(gate.settings.baseline)), BaselineText(baseline));
}

TEST_F(EnvelopeGate, LossesOfAreaAndOfSuccessGoTogether) {
  const Gate gate = Load();
  const Baseline baseline = Measure(gate, DocksIn(0.6));
  const EnvelopeShift shift(gate.plan, baseline.conditions[0]);
  EXPECT_NEAR(shift.area(), 0.6, 0.06);
  EXPECT_NEAR(shift.AreaLost(0), 0, 0.005);
  for (const double area : {-0.1, 0.02, 0.05, 0.2}) {
    const double success = shift.SuccessLost(area);
    EXPECT_GT(success / area, 0) << area;
    EXPECT_NEAR(shift.AreaLost(success), area, 0.005);
  }
  EXPECT_LT(shift.SuccessLost(0.05), shift.SuccessLost(0.1));
  EXPECT_NEAR(shift.AreaLost(1), shift.area(), 1e-4) << "no more than there is";
  // By the truth: what the rate of the very trials falls by when the boundary moves as far.
  const double log_odds = std::log(9);
  double expected = 0;
  for (const batch::ComparedTrial& trial : baseline.conditions[0].outcomes) {
    const double place = static_cast<double>(gate.plan.Trial(trial.trial).cell % 41) / 40;
    const auto rate = [&](double share) {
      return 1 / (1 + std::exp(-(log_odds + 30 * (share - place))));
    };
    expected += (rate(0.6) - rate(0.5)) / baseline.conditions[0].trials;
  }
  EXPECT_NEAR(shift.SuccessLost(0.1), expected, 0.4 * expected);
}

TEST_F(EnvelopeGate, OnlyWhatHasToPassIsWarnedOfTooFewTrials) {
  const Gate gate = Load("{area: 0.001}");
  GateRun search(gate);
  EXPECT_THAT(search.Remarks(), IsEmpty());
  Drive(gate, DocksIn(0.6), &search, 1);
  EXPECT_THAT(GateRun(gate, search.Measured()).Remarks(),
              ElementsAre(HasSubstr("trials are too few"), HasSubstr("trials are too few")));
}

TEST_F(EnvelopeGate, ErrsAsSeldomAsItSays) {
  // Today's luck has nothing to do with the baseline's: the worst that pairs can be.
  constexpr int kRepetitions = 8;
  const Gate gate = Load("{area: 0.1}");
  int false_alarms = 0, missed = 0, noticed = 0;
  for (int i = 0; i < kRepetitions; ++i) {
    const Baseline baseline = Measure(gate, DocksIn(0.6, fmt::format("before {}", i)));
    const std::string luck = fmt::format("now {}", i);
    false_alarms += Judge(gate, baseline, DocksIn(0.6, luck)).verdict == Verdict::kFail;
    for (const ConditionReport& c : Judge(gate, baseline, DocksIn(0.5, luck)).conditions) {
      missed += c.verdict == Verdict::kPass;
      noticed += c.verdict == Verdict::kFail;
    }
  }
  // Of 5 %: more than that has a probability of 0.1 %.
  EXPECT_LE(false_alarms, 3);
  EXPECT_LE(missed, 4);
  EXPECT_GE(noticed, kRepetitions);
}

TEST_F(EnvelopeGate, SaysWhatDoesNotGoTogether) {
  const auto refusal = [&](auto... what) { return MessageOf([&] { Load(what...); }); };
  EXPECT_THAT(refusal("{success_rate: 0.1}"),
              HasSubstr("margins.success_rate: the plan has ranges: the only margin is `area`"));
  EXPECT_THAT(refusal("{}"), HasSubstr("margins.area: this key is required"));
  EXPECT_THAT(refusal("{area: 0.05}", "  max_trials: 50\n"), HasSubstr("the baseline chose"));
  EXPECT_THAT(refusal("{area: 0.05}", "  never: [collision]\n"), HasSubstr("leave it out"));
  EXPECT_THAT(refusal("{area: 0.05}", "", ""), HasSubstr("is for a plan with ranges"));
  EXPECT_THAT(refusal("{area: 0.05}", "  conditions: {rough: {margins: {time_s: 1}}}\n"),
              HasSubstr("the only margin is `area`"));
  const Gate gate = Load("{area: 0.7}");
  const Baseline baseline = Measure(gate, DocksIn(0.6));
  EXPECT_THAT(MessageOf([&] { GateRun(gate, baseline); }), HasSubstr("it cannot lose 0.7"));
  const Gate wider = Load("{area: 0.05}", "",
                          "ranges:\n  water.milk_ml_m3: {from: 0, to: 50, success: falls}\n"
                          "find: {rate: 0.9, width: 0.1}\n");
  EXPECT_THAT(MessageOf([&] { GateRun(wider, baseline); }), HasSubstr("0 to 50"));
}

}  // namespace
}  // namespace turbidock::gate
