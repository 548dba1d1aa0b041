// The gate on synthetic trials: verdicts and what a report says of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "experiments/report/report.h"
#include "sim/base/random.h"
#include "tests/studies/gate/synthetic_gate.h"
#include "tests/support/message_of.h"

namespace turbidock::gate {
namespace {

using statistics::Verdict;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;
using ::testing::Not;

using GateVerdict = SyntheticGate;

TEST_F(GateVerdict, TheSameBuildPassesWithTheFewestTrials) {
  const Gate gate = Load();
  const Baseline baseline = Measure(gate, DocksAt(0.95));
  const GateProgress before = GateRun(gate, baseline).progress();
  int trials = 0;
  const GateReport report = Judge(gate, baseline, DocksAt(0.95), /*at_once=*/1, &trials);
  EXPECT_EQ(report.verdict, Verdict::kPass);
  EXPECT_LT(trials, 45);
  EXPECT_EQ(before.least, trials);
  EXPECT_EQ(before.most, 200);
  const ConditionReport& calm = report.conditions.at(0);
  EXPECT_EQ(calm.trials, trials);
  EXPECT_EQ(std::ssize(calm.outcomes), trials);
  EXPECT_THAT(calm.flips, IsEmpty());
  ASSERT_EQ(calm.changes.size(), 3u) << "those with a margin";
  for (const batch::Change& change : calm.changes) {
    EXPECT_EQ(change.verdict, Verdict::kPass);
    EXPECT_EQ(change.a, change.b);
    EXPECT_EQ(change.worse + change.better, 0);
  }
}

TEST_F(GateVerdict, TheReportSaysWhichLossEachConditionNotices) {
  Gate gate = Load(kRough, "  conditions: {rough: {margins: {success_rate: 0.3}}}\n");
  gate.assignments = {"control.use=pid"};
  const GateReport report = Judge(gate, Measure(gate, DocksAt(0.95)), DocksAt(0.95));
  const report::Report shown = ReportOf(report);
  EXPECT_THAT(SectionOf(shown, "What changed").table->Text(), HasSubstr("-10 "));
  const report::Panel& picture = SectionOf(shown, "What changed").panels.at(0);
  EXPECT_EQ(picture.x.label, "change for the worse, in margins");
  EXPECT_EQ(picture.y.names.size(), 6u) << "three measures of two conditions";
  EXPECT_EQ(picture.rules[1].at, 1) << "the margin";
  const auto& rows = SectionOf(shown, "Conditions").table->rows();
  for (size_t i = 0; i < 2; ++i)
    EXPECT_EQ(rows[i].back().text,
              fmt::format("{:.1f} points", 100 * *report.conditions[i].smallest_loss_noticed));
  // as by the test itself, with its share of alpha: of three tests of either condition
  const statistics::PairedDesign test{.margin = 0.1, .alpha = 0.05 / 6, .beta = 0.05, .most = 200};
  EXPECT_NEAR(FailRate(test, *report.conditions[0].smallest_loss_noticed), 0.8, 0.01);
  EXPECT_EQ(shown.facts.back().value, "control.use=pid");
}

TEST_F(GateVerdict, TheReportLinksEverySeedThatChanged) {
  const Gate gate = Load();
  const Baseline baseline = Measure(gate, DocksAt(0.9));
  const GateReport report = Judge(gate, baseline, [](int64_t, int64_t seed) {
    const double u = Noise(seed, "docks").Uniform();  // as in the baseline: below 0.9
    return DocksAt(u < 0.7 || u > 0.9 ? 1 : 0)(0, seed);
  });
  const report::Report shown = ReportOf(report);
  int lost = 0, gained = 0;
  for (const auto& row : SectionOf(shown, "Seeds that changed").table->rows()) {
    EXPECT_EQ(row[0].link, "calm_" + row[0].text);
    EXPECT_EQ(row[3].text, "timeout") << "how the other side ended";
    ++(row[1].text == "lost" ? lost : gained);
  }
  const batch::Change& success = report.conditions[0].changes[0];
  EXPECT_GT(lost, 0);
  EXPECT_EQ(lost, success.worse);
  EXPECT_GT(gained, 0);
  EXPECT_EQ(gained, success.better);
  EXPECT_EQ(shown.facts[1].value, std::to_string(lost));
  const GateReport none = Judge(gate, baseline, DocksAt(0.9));
  EXPECT_THAT(SectionOf(ReportOf(none), "Seeds that changed").lines[0], HasSubstr("None"));
}

// All of batch::kMeasures, each worse by more than its margin and nothing else.
TEST_F(GateVerdict, EachMeasureFailsForItsOwnReason) {
  Gate gate = Load();
  gate.conditions[0].settings.margins.medians = {5, 0.01, 0.01, 1, 0.05, 0.1, 0.3};
  const Baseline baseline = Measure(gate, DocksAt(0.95));
  EXPECT_EQ(Judge(gate, baseline, DocksAt(0.95)).verdict, Verdict::kPass);
  const auto failed = [&](const Build& build) {
    std::vector<std::string> names;
    const GateReport report = Judge(gate, baseline, build);
    for (const batch::Change& change : report.conditions.at(0).changes)
      if (change.verdict == Verdict::kFail) names.push_back(change.measure);
    return names;
  };
  EXPECT_THAT(failed(DocksAt(0.6)), ElementsAre("success_rate"));
  const std::vector<std::function<void(trial::TrialRecord*)>> worse = {
      [](auto* r) { r->time_s += 8; },
      [](auto* r) { r->final_error_true.y_m += 0.02; },
      [](auto* r) { r->tracking_rms_m += 0.02; },
      [](auto* r) { r->returns_to_servoing += 1; },
      [](auto* r) { r->fitness_mean -= 0.05; },
      [](auto* r) { r->effort_v += 0.1; },
      [](auto* r) { r->false_confidence_s += 0.5; }};
  ASSERT_EQ(worse.size(), batch::kMeasures.size());
  for (size_t i = 0; i < worse.size(); ++i)
    EXPECT_THAT(failed(DocksAt(0.95, worse[i])), ElementsAre(batch::kMeasures[i].name));
}

TEST_F(GateVerdict, BetterIsNoFailure) {
  const Gate gate = Load();
  const GateReport report = Judge(gate, Measure(gate, DocksAt(0.8)), Slower(1, -10));
  EXPECT_EQ(report.verdict, Verdict::kPass);
  EXPECT_THAT(report.conditions.at(0).flips, Not(IsEmpty()));
  for (const batch::Flip& flip : report.conditions[0].flips)
    EXPECT_EQ(flip.change, batch::FlipKind::kGained);
}

// Whatever moves every trial the same way: a refactoring's rounding, or a real loss.
TEST_F(GateVerdict, EveryTrialWorseByLessThanTheMarginPasses) {
  const Gate gate = Load();
  const Baseline baseline = Measure(gate, DocksAt(0.95));
  for (const double slower_s : {1e-9, 4.9})
    EXPECT_EQ(Judge(gate, baseline, Slower(0.95, slower_s)).verdict, Verdict::kPass) << slower_s;
  EXPECT_EQ(Judge(gate, baseline, Slower(0.95, 5.1)).verdict, Verdict::kFail);
}

TEST_F(GateVerdict, ALostSeedSaysWhyAsABatchDoes) {
  const Gate gate = Load();
  const GateReport report = Judge(gate, Measure(gate, DocksAt(0.95)), [](int64_t, int64_t seed) {
    trial::TrialRecord record = Ended(seed, false);
    record.failure = trial::Failure::kOscillation;
    return record;
  });
  ASSERT_THAT(report.conditions.at(0).flips, Not(IsEmpty()));
  EXPECT_EQ(report.conditions[0].flips[0].why, "oscillation");
}

TEST_F(GateVerdict, TooFewTrialsAreInconclusive) {
  const Gate gate = Load("", "  max_trials: 10\n");
  const GateReport report = Judge(gate, Measure(gate, DocksAt(0.95)), DocksAt(0.95));
  EXPECT_EQ(report.verdict, Verdict::kInconclusive);
  EXPECT_EQ(report.conditions.at(0).trials, 10);
  // which is said before the first of them, with how many would do
  const std::vector<std::string> remarks = GateRun(gate).Remarks();
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_THAT(remarks[0], HasSubstr("condition 'calm': 10 trials are too few to pass"));
  const auto would_do = std::stoi(remarks[0].substr(remarks[0].find("say; ") + 5));
  const Gate enough = Load("", fmt::format("  max_trials: {}\n", would_do));
  EXPECT_THAT(GateRun(enough).Remarks(), IsEmpty());
  EXPECT_EQ(Judge(enough, Measure(enough, DocksAt(1)), DocksAt(1)).verdict, Verdict::kPass);
}

TEST_F(GateVerdict, TheVerdictDoesNotDependOnHowManyTrialsRunAtOnce) {
  const Gate gate = Load(kRough, "  conditions: {rough: {never: [collision]}}\n");
  const Baseline baseline = Measure(gate, DocksAt(0.9));
  const Build collides = [](int64_t condition, int64_t seed) {
    return condition == 1 && Noise(seed, "hits").Uniform() < 0.04
               ? Ended(seed, trial::Outcome::kCollision)
               : DocksAt(0.9)(condition, seed);
  };
  for (const Build& build : {DocksAt(0.88), DocksAt(0.7), Slower(0.9, 2), collides}) {
    const std::string one = JsonOf(Judge(gate, baseline, build, 1));
    for (const size_t at_once : {2u, 5u, 64u})
      EXPECT_EQ(JsonOf(Judge(gate, baseline, build, at_once)), one);
  }
}

TEST_F(GateVerdict, AWorseConditionIsFoundAmongGoodOnes) {
  const Gate gate = Load(kRough);
  const GateReport report =
      Judge(gate, Measure(gate, DocksAt(0.95)), [](int64_t condition, int64_t seed) {
        return DocksAt(condition == 1 ? 0.5 : 0.95)(condition, seed);
      });
  EXPECT_EQ(report.verdict, Verdict::kFail);
  EXPECT_EQ(report.conditions.at(0).verdict, Verdict::kPass);
  EXPECT_EQ(report.conditions.at(1).verdict, Verdict::kFail);
  EXPECT_THAT(report.conditions.at(1).flips, Not(IsEmpty()));
}

TEST_F(GateVerdict, OneTrialThatEndsAsNoneMayFailsTheGateAtOnce) {
  const Gate gate = Load(kRough, "  never: [collision, false_dock]\n");
  const Build build = [&](int64_t condition, int64_t seed) {
    return condition == 1 && seed == gate.plan.Trial(gate.plan.NumberOf(1, 4)).seed
               ? Ended(seed, trial::Outcome::kFalseDock)
               : DocksAt(0.95)(condition, seed);
  };
  EXPECT_THAT(MessageOf([&] { Judge(gate, Measure(gate, build), build); }),
              HasSubstr("ends as false_dock in the baseline, which `never` forbids"));
  // It did not succeed before, either: no seed is lost.
  const Build before = [&](int64_t condition, int64_t seed) {
    return Ended(seed, build(condition, seed).outcome == trial::Outcome::kSuccess
                           ? trial::Outcome::kSuccess
                           : trial::Outcome::kTimeout);
  };
  const GateReport report = Judge(gate, Measure(gate, before), build);
  EXPECT_EQ(report.verdict, Verdict::kFail);
  EXPECT_THAT(report::Text(ReportOf(report)), HasSubstr("forbidden"));
  EXPECT_EQ(report.conditions[0].trials, 5);
  EXPECT_EQ(report.conditions[1].trials, 5);
  ASSERT_EQ(report.conditions[1].flips.size(), 1u) << "to be replayed";
  EXPECT_EQ(report.conditions[1].flips[0].why, "false_dock, as none may end");
  EXPECT_EQ(report.conditions[1].flips[0].change, batch::FlipKind::kForbidden);
  EXPECT_THAT(report::Text(ReportOf(report)), HasSubstr("the gate failed at once. rough: seed "));
}

TEST_F(GateVerdict, OtherBuildsStandBesideThisOne) {
  const Gate gate = Load(kRough);
  const Baseline baseline = Measure(gate, DocksAt(0.95));
  const GateReport good = Judge(gate, baseline, DocksAt(0.95)),
                   bad = Judge(gate, baseline, DocksAt(0.6));
  const report::Report shown = ReportOf(good, {{"out/slow", bad}});
  const auto& rows = SectionOf(shown, "Builds side by side").table->rows();
  EXPECT_EQ(rows[0][1].text, "pass");
  EXPECT_EQ(rows[0][2].text, "fail");
  EXPECT_THAT(rows[2][2].text, HasSubstr("fail: "));
}

// A build that only chance tells from another of the same rate.
Build ChanceBuild(const std::string& stream, double rate) {
  return [=](int64_t, int64_t seed) {
    Rng rng = Noise(seed, stream);
    const bool docks = rng.Uniform() < rate;
    trial::TrialRecord record = Ended(seed, docks, 40 + 4 * rng.Normal());
    record.final_error_true.y_m = 0.01 + 0.002 * rng.Normal();
    return record;
  };
}

// Of many gates, each with a baseline of its own: how often a build of the same rates fails, and
// how often one that is worse by the margin passes. An error rate of 0.05 exceeds the counts
// allowed here less than once in a hundred times.
TEST_F(GateVerdict, FalseAlarmsAndMissesStayWithinAlphaAndBetaInPairs) {
  const Gate loaded = Load();
  int alarms = 0, misses = 0;
  for (int number = 0; number < 150; ++number) {
    Gate gate = loaded;
    gate.plan = loaded.plan.WithSeeds(number, 200);
    const std::string name = std::to_string(number);
    const Baseline baseline = Measure(gate, ChanceBuild("old" + name, 0.95));
    alarms += Judge(gate, baseline, ChanceBuild("new" + name, 0.95)).verdict == Verdict::kFail;
    misses += Judge(gate, baseline, ChanceBuild("new" + name, 0.85)).verdict == Verdict::kPass;
  }
  EXPECT_LE(alarms, 14);
  EXPECT_LE(misses, 14);
}

TEST_F(GateVerdict, AlphaIsSharedByAllTestsOfAGateUnlessToldOtherwise) {
  const auto alpha = [&](const std::string& covers) {
    return Load(kRough, "  alpha_covers: " + covers + "\n").conditions[0].options().alpha;
  };
  EXPECT_DOUBLE_EQ(alpha("gate"), 0.05 / 6);
  EXPECT_DOUBLE_EQ(alpha("condition"), 0.05 / 3);
  EXPECT_DOUBLE_EQ(alpha("test"), 0.05);
}

TEST_F(GateVerdict, TheReportsAlphaCountsTheConditionsOwn) {
  const auto said = [&](const std::string& covers, const std::string& own) {
    const Gate gate = Load(kRough, "  alpha_covers: " + covers + "\n" + own);
    const Build build = DocksAt(0.95);
    const GateReport report = Judge(gate, Measure(gate, build), build);
    return std::pair(report.alpha, report.beta);
  };
  const std::string own = "  conditions: {rough: {alpha: 0.2, beta: 0.3}}\n";
  for (const char* covers : {"gate", "condition", "test"}) {
    EXPECT_NEAR(said(covers, "").first, 0.05, 1e-12) << covers;
    // Both conditions have as many tests.
    EXPECT_NEAR(said(covers, own).first, std::string(covers) == "gate" ? 0.125 : 0.2, 1e-12);
    EXPECT_EQ(said(covers, own).second, 0.3);
  }
}

TEST(BundleNames, AreAllDifferentInAFolder) {
  EXPECT_EQ(BundleNames({"night sea", "night/sea", "Night sea", "night_sea_2", "55 %", "pool"}),
            (std::vector<std::string>{"night_sea", "night_sea_2", "Night_sea_3", "night_sea_2_2",
                                      "55__", "pool"}));
}

}  // namespace
}  // namespace turbidock::gate
