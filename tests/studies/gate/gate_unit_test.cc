// The gate on synthetic trials: verdicts, pairing, baselines, reports, and what is refused.

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/studies/gate/gate.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "experiments/report/report.h"
#include "experiments/report/report_json.h"
#include "experiments/system/subprocess.h"
#include "sim/base/check.h"
#include "sim/base/digest.h"
#include "sim/base/random.h"
#include "tests/support/message_of.h"

namespace turbidock::gate {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;
using ::testing::Not;

// How a build docks: from the seed alone, as a trial does.
using Build = std::function<GateTrial(size_t condition, int64_t seed)>;

Rng Noise(int64_t seed, const char* what) {
  return SeedTree(static_cast<uint64_t>(seed)).Stream(what);
}

// What a trial docks with, in the order of kMedianMeasures.
struct Quality {
  double time_s = 0, final_error_m = 0, returns_to_servoing = 0, fitness = 0, effort_v = 0,
         false_confidence_s = 0;

  MedianValues Values() const {
    return {time_s, final_error_m, returns_to_servoing, fitness, effort_v, false_confidence_s};
  }
};

// Docks at a rate, after about 40 s; so much worse.
Build DocksAt(double rate, const Quality& more = {}) {
  return [=](size_t, int64_t seed) {
    const bool docks = Noise(seed, "docks").Uniform() < rate;
    const Quality quality{
        .time_s = 40 + 4 * Noise(seed, "time").Normal() + more.time_s,
        .final_error_m = 0.01 + 0.005 * Noise(seed, "error").Uniform() + more.final_error_m,
        .returns_to_servoing =
            std::floor(3 * Noise(seed, "returns").Uniform()) + more.returns_to_servoing,
        .fitness = 0.6 + 0.05 * Noise(seed, "fitness").Normal() + more.fitness,
        .effort_v = 1 + 0.1 * Noise(seed, "effort").Uniform() + more.effort_v,
        .false_confidence_s = 0.2 * Noise(seed, "claims").Uniform() + more.false_confidence_s};
    GateTrial trial{.seed = seed,
                    .outcome = docks ? trial::Outcome::kDocked : trial::Outcome::kTimeout,
                    .values = quality.Values(),
                    .digest = ""};
    Digest digest;
    digest.Add(std::string(NameOf(trial.outcome)));
    for (const double value : trial.values) digest.Add(value);
    trial.digest = digest.Hex();
    return trial;
  };
}

// Gives results as a build would; of those under way the last one that was asked for comes first.
GateRunner RunnerOf(const GatePlan& plan, const Build& build, size_t at_once = 3,
                    int* trials_run = nullptr) {
  return [=, &plan](const GateTrials& trials) {
    std::vector<int64_t> under_way;
    for (;;) {
      while (under_way.size() < at_once) {
        const auto trial = trials.next();
        if (!trial) break;
        under_way.push_back(*trial);
      }
      if (under_way.empty()) return;
      const int64_t trial = under_way.back(), conditions = std::ssize(plan.conditions);
      under_way.pop_back();
      trials.add(trial, build(static_cast<size_t>(trial % conditions),
                              plan.SeedOf(static_cast<int>(trial / conditions))));
      if (trials_run) ++*trials_run;
    }
  };
}

class Gate : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string File(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  // Lines 1 to 9 are the gate's, then those of `more`.
  std::string PlanFile(const std::string& more = "") {
    return File("gate.yaml",
                "schema_version: 1\n"
                "description: docking\n"
                "baseline: gate.baseline.yaml\n"
                "max_trials: 200\n"
                "margins: {success_rate: 0.1, time_s: 5, final_error_m: 0.01}\n"
                "conditions:\n"
                "  - name: calm\n"
                "    scenario: pool_active\n"
                "    set: {water.milk_ml_m3: 20, sea: {state: calm}}\n" +
                    more);
  }
  GatePlan Plan(const std::string& more = "") { return LoadGatePlan(PlanFile(more)); }

  static Baseline Measure(const GatePlan& plan, const Build& build) {
    return MeasureBaseline(plan, RunnerOf(plan, build, 7));
  }
  static std::string JsonOf(const GateReport& report) {
    return report::JsonText(report::Document(ReportOf(report), report));
  }
  static GateReport Judge(const GatePlan& plan, const Baseline& baseline, const Build& build,
                          size_t at_once = 3, int* trials = nullptr) {
    return RunGate(plan, baseline, RunnerOf(plan, build, at_once, trials));
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() /
      (std::string("turbidock_gate_") +
       ::testing::UnitTest::GetInstance()->current_test_info()->name() + "_" +
       std::to_string(getpid()));
};

// -------------------------------------------------------------------------------------- verdicts

TEST_F(Gate, TheSameBuildPassesWithFewTrials) {
  const GatePlan plan = Plan();
  int trials = 0;
  const GateReport report =
      Judge(plan, Measure(plan, DocksAt(0.95)), DocksAt(0.95), /*at_once=*/1, &trials);
  EXPECT_EQ(report.verdict, statistics::Verdict::kPass);
  EXPECT_LT(trials, 45);
  const ConditionReport& calm = report.conditions.at(0);
  EXPECT_EQ(calm.trials, trials);
  EXPECT_EQ(std::ssize(calm.outcomes), trials);
  EXPECT_THAT(calm.newly_failing_seeds, IsEmpty());
  ASSERT_EQ(calm.measures.size(), 3u);
  for (const MeasureReport& measure : calm.measures) {
    EXPECT_EQ(measure.verdict, statistics::Verdict::kPass);
    EXPECT_EQ(measure.before, measure.now);
    EXPECT_EQ(measure.worse + measure.better, 0);
  }
}

const report::Section& SectionOf(const report::Report& report, const std::string& title) {
  for (const report::Section& section : report.sections)
    if (section.title == title) return section;
  throw std::runtime_error("no section " + title);
}

TEST_F(Gate, TheReportSaysWhichLossEachConditionWouldHaveShown) {
  const GatePlan plan =
      Plan("  - {name: rough, scenario: pool_active, margins: {success_rate: 0.3}}\n");
  const Baseline baseline = Measure(plan, DocksAt(0.95));
  GateReport report = Judge(plan, baseline, DocksAt(0.95));
  report.assignments = {"controller=pid"};
  const report::Report shown = ReportOf(report);
  EXPECT_THAT(SectionOf(shown, "Measures").table->Text(), HasSubstr("-10.0 points"));
  const auto beta = std::ranges::find(shown.facts, "beta", &report::Fact::label);
  ASSERT_NE(beta, shown.facts.end());
  EXPECT_EQ(beta->value, "0.05");
  const auto seen = std::ranges::find(shown.facts, "would have seen", &report::Fact::label);
  ASSERT_NE(seen, shown.facts.end());
  EXPECT_EQ(seen->value,
            fmt::format("{:.1f} points, {:.1f} points", 100 * *report.conditions[0].least_loss_seen,
                        100 * *report.conditions[1].least_loss_seen));
  // as by the test itself, with its share of alpha: of three tests of either condition
  const statistics::PairedRateTest test(0.1, 0.05 / 6, 0.05, 200);
  EXPECT_NEAR(test.FailRate(*report.conditions[0].least_loss_seen), 0.8, 0.01);
  EXPECT_EQ(shown.facts.back().value, "controller=pid");
}

TEST_F(Gate, TheReportLinksEverySeedThatChanged) {
  const GatePlan plan = Plan();
  const GateReport report = Judge(plan, Measure(plan, DocksAt(0.9)), [](size_t, int64_t seed) {
    const double u = Noise(seed, "docks").Uniform();  // as in the baseline: below 0.9
    return DocksAt(u < 0.7 || u > 0.9 ? 1 : 0)(0, seed);
  });
  const ConditionReport& calm = report.conditions[0];
  ASSERT_THAT(calm.newly_failing_seeds, Not(IsEmpty()));
  ASSERT_THAT(calm.newly_docking_seeds, Not(IsEmpty()));
  const report::Report shown = ReportOf(report);
  std::vector<std::string> failing, docking;
  for (const auto& row : SectionOf(shown, "Seeds that changed").table->rows()) {
    EXPECT_EQ(row[1].link, "calm_" + row[1].text);
    (row[2].text == "docks now" ? docking : failing).push_back(row[1].text);
  }
  const auto texts = [](const std::vector<int64_t>& seeds) {
    std::vector<std::string> list;
    for (const int64_t seed : seeds) list.push_back(std::to_string(seed));
    return list;
  };
  EXPECT_EQ(failing, texts(calm.newly_failing_seeds));
  EXPECT_EQ(docking, texts(calm.newly_docking_seeds));
  EXPECT_EQ(shown.facts[1].value, std::to_string(failing.size()));
  const GateReport none = Judge(plan, Measure(plan, DocksAt(0.95)), DocksAt(0.95));
  EXPECT_THAT(SectionOf(ReportOf(none), "Seeds that changed").lines[0], HasSubstr("None"));
}

TEST_F(Gate, EachMeasureFailsForItsOwnReason) {
  GatePlan plan = Plan();
  plan.conditions[0].margins.medians = {5, 0.01, 1, 0.05, 0.1, 0.3};
  const Baseline baseline = Measure(plan, DocksAt(0.95));
  EXPECT_EQ(Judge(plan, baseline, DocksAt(0.95)).verdict, statistics::Verdict::kPass);
  const auto failed = [&](const Build& build) {
    const GateReport report = Judge(plan, baseline, build);
    EXPECT_EQ(report.verdict, statistics::Verdict::kFail);
    std::vector<std::string> names;
    for (const MeasureReport& measure : report.conditions.at(0).measures)
      if (measure.verdict == statistics::Verdict::kFail) names.push_back(measure.measure);
    return names;
  };
  EXPECT_THAT(failed(DocksAt(0.6)), ElementsAre("success rate"));
  EXPECT_THAT(failed(DocksAt(0.95, {.time_s = 8})), ElementsAre("time to dock"));
  EXPECT_THAT(failed(DocksAt(0.95, {.final_error_m = 0.02})), ElementsAre("final true error"));
  EXPECT_THAT(failed(DocksAt(0.95, {.returns_to_servoing = 1})),
              ElementsAre("returns to servoing"));
  EXPECT_THAT(failed(DocksAt(0.95, {.fitness = -0.05})), ElementsAre("fitness"));
  EXPECT_THAT(failed(DocksAt(0.95, {.effort_v = 0.1})), ElementsAre("effort"));
  EXPECT_THAT(failed(DocksAt(0.95, {.false_confidence_s = 0.5})), ElementsAre("false confidence"));
}

TEST(MedianMeasures, AreThoseOfTheRecord) {
  trial::TrialRecord record;
  record.time_s = 12;
  record.final_error_true.x_m = 0.3;
  record.final_error_true.y_m = -0.4;
  record.returns_to_servoing = 2;
  record.fitness_mean = 0.7;
  record.fitness_best = 0.9;
  record.effort_v = 1.5;
  record.false_confidence_s = 0.25;
  std::map<std::string, double> values;
  for (const MedianMeasure& measure : kMedianMeasures) values[measure.key] = measure.of(record);
  EXPECT_EQ(values, (std::map<std::string, double>{{"time_s", 12},
                                                   {"final_error_m", 0.5},
                                                   {"returns_to_servoing", 2},
                                                   {"fitness", 0.7},
                                                   {"effort_v", 1.5},
                                                   {"false_confidence_s", 0.25}}));
}

TEST_F(Gate, AnOlderBaselineWithoutTheMeasureIsRefused) {
  GatePlan plan = Plan();
  Baseline baseline = Measure(plan, DocksAt(0.9));
  for (BaselineCondition& condition : baseline.conditions)
    for (GateTrial& trial : condition.outcomes) trial.values.back() = GateTrial().values.back();
  EXPECT_EQ(Judge(plan, baseline, DocksAt(0.9)).verdict, statistics::Verdict::kPass);
  plan.conditions[0].margins.medians.back() = 0.3;
  EXPECT_THAT(MessageOf([&] { Judge(plan, baseline, DocksAt(0.9)); }),
              HasSubstr("the baseline has no false_confidence_s"));
}

TEST_F(Gate, BetterIsNoFailure) {
  const GatePlan plan = Plan();
  const Baseline baseline = Measure(plan, DocksAt(0.8));
  const GateReport report =
      Judge(plan, baseline, DocksAt(1.0, {.time_s = -10, .final_error_m = -0.005, .fitness = 0.1}));
  EXPECT_EQ(report.verdict, statistics::Verdict::kPass);
  EXPECT_THAT(report.conditions.at(0).newly_docking_seeds, Not(IsEmpty()));
}

// Whatever moves every trial the same way: a refactoring's rounding, or a real loss.
TEST_F(Gate, EveryTrialWorseByLessThanTheMarginPasses) {
  const GatePlan plan = Plan();
  const Baseline baseline = Measure(plan, DocksAt(0.95));
  for (const double slower_s : {1e-9, 4.9})
    EXPECT_EQ(Judge(plan, baseline, DocksAt(0.95, {.time_s = slower_s})).verdict,
              statistics::Verdict::kPass)
        << slower_s;
  EXPECT_EQ(Judge(plan, baseline, DocksAt(0.95, {.time_s = 5.1})).verdict,
            statistics::Verdict::kFail);
}

TEST_F(Gate, TooFewTrialsAreInconclusive) {
  const GatePlan plan = Plan("    max_trials: 10\n");
  const GateReport report = Judge(plan, Measure(plan, DocksAt(0.95)), DocksAt(0.95));
  EXPECT_EQ(report.verdict, statistics::Verdict::kInconclusive);
  EXPECT_EQ(report.conditions.at(0).trials, 10);
}

TEST_F(Gate, TheVerdictDoesNotDependOnHowManyTrialsRunAtOnce) {
  const GatePlan plan = Plan("  - name: rough\n    scenario: sea_night_active\n");
  const Baseline baseline = Measure(plan, DocksAt(0.9));
  for (const Build& build : {DocksAt(0.88), DocksAt(0.7), DocksAt(0.9, {.time_s = 2})}) {
    const std::string one = JsonOf(Judge(plan, baseline, build, 1));
    for (const size_t at_once : {2u, 5u, 64u})
      EXPECT_EQ(JsonOf(Judge(plan, baseline, build, at_once)), one);
  }
}

TEST_F(Gate, AWorseConditionIsFoundAmongGoodOnes) {
  const GatePlan plan = Plan("  - name: rough\n    scenario: sea_night_active\n");
  const Baseline baseline = Measure(plan, DocksAt(0.95));
  const GateReport report = Judge(plan, baseline, [](size_t condition, int64_t seed) {
    return DocksAt(condition == 1 ? 0.5 : 0.95)(condition, seed);
  });
  EXPECT_EQ(report.verdict, statistics::Verdict::kFail);
  EXPECT_EQ(report.conditions.at(0).verdict, statistics::Verdict::kPass);
  EXPECT_EQ(report.conditions.at(1).verdict, statistics::Verdict::kFail);
  EXPECT_THAT(report.conditions.at(1).newly_failing_seeds, Not(IsEmpty()));
}

TEST_F(Gate, ABaselineOfOtherSeedsIsRefused) {
  GatePlan plan = Plan();
  const Baseline baseline = Measure(plan, DocksAt(0.95));
  plan.seed = 77;
  EXPECT_THAT(MessageOf([&] { Judge(plan, baseline, DocksAt(0.95)); }),
              HasSubstr("its trials are those of seed 1, the gate's seed is 77; measure it anew "
                        "with --update"));
}

// What did not dock has no time to dock and is not compared, and a rate is the share that docked.
TEST_F(Gate, OnlyWhatDockedHasATimeToDock) {
  BaselineCondition baseline;
  baseline.trials = 40;
  baseline.docked = 30;
  for (int i = 0; i < 40; ++i)
    baseline.outcomes.push_back(
        {.seed = i,
         .outcome = i % 4 ? trial::Outcome::kDocked : trial::Outcome::kTimeout,
         .values = {20 + 0.1 * i},
         .digest = ""});
  ConditionJudge judge(baseline, {.margins = {.success_rate = 0.6, .medians = {5}}});
  // Every second one docks, slower; the others give up at once. Of the seeds from 0 to 7 four
  // dock now, and all of these but none of seed 0 and 4 docked before.
  for (int i = 0; i < 8; ++i)
    judge.Add({.seed = i,
               .outcome = i % 2 ? trial::Outcome::kDocked : trial::Outcome::kMarkerLost,
               .values = {i % 2 ? 30.0 : 1.0},
               .digest = ""});
  const ConditionReport report = judge.Report();
  EXPECT_EQ(report.measures.at(0).now, 0.5);
  EXPECT_EQ(report.measures.at(0).before, 0.75);
  EXPECT_EQ(report.measures.at(1).compared, 4);
  EXPECT_EQ(report.measures.at(1).worse, 4);
  EXPECT_EQ(report.measures.at(1).better, 0);
  EXPECT_EQ(report.measures.at(1).now, 30);
}

// One failure is enough: it does not wait for what the other measures would say.
TEST_F(Gate, AConditionEndsWithItsFirstFailure) {
  BaselineCondition baseline;
  baseline.trials = baseline.docked = 60;
  for (int i = 0; i < 60; ++i)
    baseline.outcomes.push_back(
        {.seed = i, .outcome = trial::Outcome::kDocked, .values = {20}, .digest = ""});
  ConditionJudge judge(baseline,
                       {.max_trials = 60, .margins = {.success_rate = 0.6, .medians = {5}}});
  int added = 0;  // none docks: there is no time to compare
  while (!judge.done() && added < 60)
    judge.Add({.seed = added++, .outcome = trial::Outcome::kTimeout, .digest = ""});
  EXPECT_LT(added, 20);
  EXPECT_EQ(judge.Report().verdict, statistics::Verdict::kFail);
  EXPECT_FALSE(judge.Report().measures.at(1).decided_after_trials);
}

// A build that only chance tells from another of the same rate.
Build ChanceBuild(const std::string& stream, double rate) {
  return [=](size_t, int64_t seed) {
    Rng rng = Noise(seed, stream.c_str());
    const bool docks = rng.Uniform() < rate;
    return GateTrial{.seed = seed,
                     .outcome = docks ? trial::Outcome::kDocked : trial::Outcome::kTimeout,
                     .values = {40 + 4 * rng.Normal(), 0.01 + 0.002 * rng.Normal()},
                     .digest = "0"};
  };
}

// Of many gates, each with a baseline of its own: how often a build of the same rates fails, and
// how often one that is worse by the margin passes. An error rate of 0.05 exceeds the counts
// allowed here less than once in a hundred times.
TEST_F(Gate, FalseAlarmsAndMissesStayWithinAlphaAndBetaInPairs) {
  GatePlan plan = Plan();
  int alarms = 0, misses = 0;
  for (int gate = 0; gate < 300; ++gate) {
    plan.seed = gate;
    const std::string name = std::to_string(gate);
    const Baseline baseline = Measure(plan, ChanceBuild("old" + name, 0.95));
    alarms += Judge(plan, baseline, ChanceBuild("new" + name, 0.95)).verdict ==
              statistics::Verdict::kFail;
    misses += Judge(plan, baseline, ChanceBuild("new" + name, 0.85)).verdict ==
              statistics::Verdict::kPass;
  }
  EXPECT_LE(alarms, 24);
  EXPECT_LE(misses, 24);
}

TEST_F(Gate, AlphaIsSharedByAllTestsOfAGateUnlessToldOtherwise) {
  const std::string more = "  - name: rough\n    scenario: sea_night_active\n";
  GatePlan plan = Plan(more);
  const auto alpha = [&] { return plan.OptionsFor(plan.conditions[0]).alpha; };
  EXPECT_DOUBLE_EQ(alpha(), 0.05 / 6);
  plan.alpha_covers = AlphaCovers::kCondition;
  EXPECT_DOUBLE_EQ(alpha(), 0.05 / 3);
  plan.alpha_covers = AlphaCovers::kTest;
  EXPECT_DOUBLE_EQ(alpha(), 0.05);
}

// -------------------------------------------------------------------------------------- baselines

TEST_F(Gate, ABaselineReadsBackAsItWasWritten) {
  const GatePlan plan = Plan();
  const Baseline baseline = Measure(plan, DocksAt(0.9));
  const std::string text = BaselineText(baseline);
  const Baseline read = LoadBaseline(File("gate.baseline.yaml", text));
  EXPECT_EQ(BaselineText(read), text);
  EXPECT_EQ(read.conditions.at(0).outcomes.size(), 200u);
  // a line a trial
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 200 + 20);
  EXPECT_EQ(JsonOf(Judge(plan, read, DocksAt(0.85))), JsonOf(Judge(plan, baseline, DocksAt(0.85))));
}

TEST_F(Gate, AnyEditOfABaselineIsNoticed) {
  const GatePlan plan = Plan();
  const std::string text = BaselineText(Measure(plan, DocksAt(0.9)));
  const auto refused = [&](const std::string& edited) {
    return MessageOf([&] { LoadBaseline(File("edited.yaml", edited)); });
  };
  std::string turned = text;
  turned.replace(turned.find("timeout"), 7, "docked");
  EXPECT_THAT(refused(turned), HasSubstr("was edited"));
  EXPECT_THAT(refused("# a remark\n" + text), HasSubstr("was edited"));
  EXPECT_THAT(refused(text + "\n"), HasSubstr("was edited"));
  EXPECT_THAT(refused(text.substr(0, text.rfind("checksum"))), HasSubstr("was edited"));
  std::string schema = text;
  schema.replace(schema.find("schema_version: 2"), 17, "schema_version: 1");
  EXPECT_THAT(refused(schema),
              HasSubstr("schema_version = 1, must be in [2, 2]; measure it anew with --update"));
  EXPECT_THAT(MessageOf([&] { LoadBaseline((folder_ / "none.yaml").string()); }),
              HasSubstr("there is no baseline"));
}

TEST_F(Gate, ABaselineOfAnotherPlanIsRefusedWithTheReason) {
  const GatePlan plan = Plan();
  const Baseline baseline = Measure(plan, DocksAt(0.9));
  const auto refused = [&](const GatePlan& other) {
    return MessageOf([&] { RequireSamePlan(other, baseline, "b.yaml"); });
  };
  EXPECT_EQ(refused(plan), "no error");
  EXPECT_THAT(refused(Plan("  - name: rough\n    scenario: sea_night_active\n")),
              HasSubstr("it has no condition 'rough'"));
  GatePlan other = plan;
  other.conditions[0].scenario = "pool_passive";
  EXPECT_THAT(refused(other), HasSubstr("was measured in scenario pool_active"));
  other = plan;
  other.conditions[0].settings = "water.milk_ml_m3=30";
  EXPECT_THAT(refused(other),
              HasSubstr("with 'water.milk_ml_m3=20 sea={state: calm}', the gate says pool_active "
                        "with 'water.milk_ml_m3=30'"));
  other = plan;
  other.conditions[0].digest = "0";
  EXPECT_THAT(refused(other), HasSubstr("the scenario file pool_active"));
  other = plan;
  other.conditions[0].name = "still";
  EXPECT_THAT(refused(other), HasSubstr("no condition 'still'"));
  // how it is judged may change
  other = plan;
  other.conditions[0].margins.success_rate = 0.2;
  other.conditions[0].alpha = 0.01;
  EXPECT_EQ(refused(other), "no error");
}

// Whatever is wrong with a baseline, it may be measured anew; nobody's other file is replaced.
TEST_F(Gate, OnlyABaselineIsReplaced) {
  GatePlan plan = Plan();
  const std::string text = BaselineText(Measure(plan, DocksAt(0.9)));
  const auto refused = [&](const std::string& there) {
    plan.baseline = File("there", there);
    int trials = 0;
    const std::string message =
        MessageOf([&] { MeasureBaseline(plan, RunnerOf(plan, DocksAt(0.9), 7, &trials)); });
    EXPECT_EQ(message == "no error", trials > 0);
    return message;
  };
  EXPECT_EQ(refused(text), "no error");
  EXPECT_EQ(refused(text + "edited: 1\n"), "no error");
  EXPECT_EQ(refused(text.substr(0, text.find("conditions"))), "no error");
  EXPECT_THAT(refused("what I noted\n"), HasSubstr("there: is no baseline of a gate and is not"));
  EXPECT_EQ(refused(""), "no error");
  EXPECT_THAT(refused("{schema_version: 1, baseline: gate.baseline.yaml}\n"),
              HasSubstr("is no baseline"));
  plan.baseline = (folder_ / "none.yaml").string();
  EXPECT_EQ(MessageOf([&] { Measure(plan, DocksAt(0.9)); }), "no error");
}

// ---------------------------------------------------------------------------------------- reports

GateReport AwkwardReport() {
  GateReport report;
  report.description = "a <gate> & \"quotes\" | \x01";
  report.build = "0.1.0 & more";
  for (const statistics::Verdict verdict : {statistics::Verdict::kPass, statistics::Verdict::kFail,
                                            statistics::Verdict::kInconclusive}) {
    ConditionReport condition;
    condition.condition = "50 % <milk> & | " + std::string(NameOf(verdict));
    condition.verdict = verdict;
    condition.outcomes.resize(2);
    condition.outcomes[0].seed = 1;
    condition.outcomes[1].seed = 9223372036854775807;
    condition.trials = 2;
    condition.docked = 1;
    condition.newly_failing_seeds = {9223372036854775807};
    MeasureReport measure;
    measure.measure = "success rate";
    measure.verdict = verdict;
    measure.before = 1;
    measure.now = 0.5;
    condition.measures.push_back(measure);
    report.conditions.push_back(condition);
  }
  report.verdict = statistics::Verdict::kFail;
  return report;
}

TEST_F(Gate, TheJunitFileIsValid) {
  const std::string schema = std::string(TURBIDOCK_TEST_DATA) + "/junit/jenkins-junit.xsd";
  const std::string file = File("junit.xml", Junit(AwkwardReport()));
  system::Subprocess({"xmllint", "--noout", "--schema", schema, file}, "libxml2-utils").Finish();
  // the schema does say no
  const std::string broken =
      File("broken.xml", "<testsuites><testsuite tests=\"1\"/></testsuites>");
  EXPECT_THROW(
      system::Subprocess({"xmllint", "--noout", "--schema", schema, broken}, "libxml2-utils")
          .Finish(),
      SimulatorFault);

  const auto xpath = [&](const std::string& expression) {
    return system::Subprocess({"xmllint", "--xpath", expression, file}, "libxml2-utils").Finish();
  };
  EXPECT_EQ(xpath("count(//testcase)"), "3\n");
  EXPECT_EQ(xpath("count(//failure)"), "1\n");
  EXPECT_EQ(xpath("count(//error)"), "1\n");
  EXPECT_EQ(xpath("string(//failure/@message)"),
            "success rate 100 % -> 50 %, worse in 0 of 0 trials, better in 0\n");
  EXPECT_EQ(xpath("string(//testsuite[2]/@name)"), "50 % <milk> & | fail\n");
}

TEST_F(Gate, TheOtherRenderersSayTheSame) {
  const GateReport gate = AwkwardReport();
  const report::Report report = ReportOf(gate);
  const auto json = nlohmann::json::parse(JsonOf(gate));
  EXPECT_EQ(json["kind"], "gate");
  EXPECT_EQ(json["schema_version"], 1);
  EXPECT_EQ(json["verdict"], "fail");
  EXPECT_EQ(json["conditions"].size(), 3u);
  EXPECT_EQ(json["conditions"][1]["newly_failing_seeds"][0], 9223372036854775807);
  EXPECT_EQ(json["conditions"][2]["measures"][0]["now"], 0.5);
  EXPECT_EQ(json["report"]["verdict"]["tone"], "bad");
  const std::string markdown = report::Markdown(report), text = report::Text(report);
  for (const std::string& rendered : {markdown, text}) {
    EXPECT_THAT(rendered, HasSubstr("fail: a <gate>"));
    EXPECT_THAT(rendered, HasSubstr("At least one measure got worse. 50 % <milk> & | fail: success "
                                    "rate 100 % -> 50 %"));
    EXPECT_THAT(rendered, HasSubstr("inconclusive"));
    EXPECT_THAT(rendered, HasSubstr("9223372036854775807"));
  }
  EXPECT_THAT(markdown, HasSubstr("\\|"));
}

// -------------------------------------------------------------------------------------- bad input

TEST_F(Gate, BadPlans) {
  const auto refused = [&](const std::string& text) {
    return MessageOf([&] { LoadGatePlan(File("bad.yaml", text)); });
  };
  const std::string head = "schema_version: 1\nbaseline: b.yaml\n";
  const std::string tail = "conditions:\n  - {name: a, scenario: pool_active}\n";
  EXPECT_EQ(refused(head + tail), "no error");
  EXPECT_THAT(refused(tail), HasSubstr("schema_version: this key is required"));
  EXPECT_THAT(refused("schema_version: 1\n" + tail), HasSubstr("baseline: this key is required"));
  EXPECT_THAT(refused(head), HasSubstr("conditions: this key is required"));
  EXPECT_THAT(refused(head + "conditions: []\n"), HasSubstr("needs a condition"));
  EXPECT_THAT(refused(head + "conditions: 3\n"), HasSubstr("must be a list"));
  EXPECT_THAT(refused(head + "alpha: 0\n" + tail),
              HasSubstr(":3: alpha = 0, must be in [1e-06, 0.999999]"));
  EXPECT_THAT(refused(head + "beta: 1\n" + tail),
              HasSubstr(":3: beta = 1, must be in [1e-06, 0.999999]"));
  EXPECT_THAT(refused(head + "margins: {success_rate: 1e-300}\n" + tail),
              HasSubstr(":3: margins.success_rate = 1e-300, must be in [1e-06, 0.999999]"));
  EXPECT_THAT(refused(head + "max_trials: 0\n" + tail), HasSubstr(":3: max_trials = 0"));
  EXPECT_THAT(refused(head + "margins: {success_rate: 1.5}\n" + tail),
              HasSubstr("margins.success_rate = 1.5, must be in [1e-06, 0.999999]"));
  EXPECT_THAT(refused(head + "aplha: 0.1\n" + tail), HasSubstr("did you mean alpha?"));
  EXPECT_THAT(refused(head + tail + "  - {name: a, scenario: pool_passive}\n"),
              HasSubstr("two conditions are named 'a'"));
  EXPECT_THAT(refused(head + "conditions:\n  - {name: a, scenario: pool_actve}\n"),
              HasSubstr("did you mean pool_active?"));
  EXPECT_THAT(refused(head + "conditions:\n  - {name: a}\n"), HasSubstr("needs a scenario"));
  EXPECT_THAT(refused(head + "conditions:\n  - {name: a, scenario: pool_active, alpha: 2}\n"),
              HasSubstr(":4: conditions[0].alpha = 2"));
  EXPECT_THAT(
      refused(head + "conditions:\n  - {name: a, scenario: pool_active, set: {watr.milk: 1}}\n"),
      HasSubstr("water"));
}

TEST_F(Gate, AConditionsSettingsAllCount) {
  const auto refused = [&](const std::string& set) {
    return MessageOf([&] {
      LoadGatePlan(File("bad.yaml",
                        "schema_version: 1\nbaseline: b.yaml\nconditions:\n  - name: a\n    "
                        "scenario: pool_active\n    set: " +
                            set + "\n"));
    });
  };
  EXPECT_EQ(refused("{water: {milk_ml_m3: 1}, sea.state: calm}"), "no error");
  EXPECT_THAT(refused("{water: {milk_ml_m3: 1}, water.milk_ml_m3: 2}"),
              HasSubstr("bad.yaml:6: conditions[0].set.water.milk_ml_m3: this key is given twice"));
  EXPECT_THAT(
      refused("{seed: 77}"),
      HasSubstr("bad.yaml:6: conditions[0].set.seed: the gate gives each trial its seed; set "
                "the gate's own `seed`"));
  EXPECT_THAT(MessageOf([&] {
                LoadGatePlan(config::AssetPath("gates/docking.yaml"), {},
                             config::ParseAssignments({"seed=77"}));
              }),
              HasSubstr("--set seed: the gate gives each trial its seed"));
}

TEST_F(Gate, ABaselineThatCannotFallIsRefused) {
  const GatePlan plan = Plan();
  const Baseline baseline = Measure(plan, DocksAt(0));
  EXPECT_THAT(MessageOf([&] { Judge(plan, baseline, DocksAt(0)); }),
              HasSubstr("cannot fall by 0.1"));
}

}  // namespace
}  // namespace turbidock::gate
