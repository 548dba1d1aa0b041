// Two result sets pair by pair, against numbers worked out by hand.

#include "experiments/batch/summary.h"
#include "experiments/studies/compare/comparison.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "experiments/media/figure.h"
#include "experiments/report/report.h"
#include "experiments/report/report_json.h"
#include "sim/base/check.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"
#include "tests/support/stored_trials.h"

namespace turbidock::compare {
namespace {

using ::testing::ContainsRegex;
using testing::End;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::Not;

class Comparison : public testing::OwnFolder {
 protected:
  struct Row {
    int64_t seed;
    bool docked;
    double time_s;
    std::string milk = "10";
  };

  batch::ResultStore Store(const std::string& name, const std::vector<Row>& rows,
                           const std::vector<std::string>& keys = {"water.milk_ml_m3"}) const {
    batch::StoreHeader header;
    header.plan =
        fmt::format("seeds: {}\ngrid: {{water.milk_ml_m3: [10, 20]}}\nset: {{sea.state: {}}}\n",
                    rows.size(), name);
    header.build = "test";
    header.trials = std::ssize(rows);
    header.keys = keys;
    std::vector<batch::StoredTrial> trials(rows.size());
    for (size_t i = 0; i < rows.size(); ++i) {
      for (const std::string& key : keys)
        trials[i].parameters.push_back({key, key == "water.milk_ml_m3" ? rows[i].milk : "1"});
      trials[i].trial = static_cast<int64_t>(i);
      trial::TrialRecord& r = trials[i].record;
      End(&r, rows[i].docked ? trial::Failure::kNone : trial::Failure::kTimeout);
      r.seed = rows[i].seed;
      r.time_s = rows[i].time_s;
    }
    return testing::StoreOf(File(name), header, trials);
  }
};

// Ten seeds: 6 succeed in both, 3 are lost, 1 is gained.
std::vector<TrialPair> TenPairs() {
  std::vector<TrialPair> pairs(10);
  for (int i = 0; i < 10; ++i) {
    trial::TrialRecord &a = pairs[static_cast<size_t>(i)].a, &b = pairs[static_cast<size_t>(i)].b;
    a.seed = b.seed = i;
    End(&a, i < 9 ? trial::Failure::kNone : trial::Failure::kTimeout);
    End(&b, i < 6 || i == 9 ? trial::Failure::kNone : trial::Failure::kTimeout);
    a.time_s = 10;
    b.time_s = 10 + i - 1;  // one faster, one equal, four slower among those that dock in both
  }
  return pairs;
}

batch::Change TimesOf(const std::vector<TrialPair>& pairs) {
  return ComparePairs(pairs, {}).changes.at(1);
}

TEST_F(Comparison, RatesOfTenPairs) {
  const compare::Comparison all = ComparePairs(TenPairs(), {});
  EXPECT_EQ(all.lost(), 3);
  EXPECT_EQ(all.gained(), 1);
  const batch::Change& c = all.all();
  EXPECT_EQ(c.pairs, 10);
  EXPECT_DOUBLE_EQ(*c.a, 0.9);
  EXPECT_DOUBLE_EQ(*c.b, 0.7);
  EXPECT_NEAR(*c.difference, -0.2, 1e-15);
  // P(at most 1 of 4 fair flips), twice: 2 (1 + 4) / 16
  EXPECT_DOUBLE_EQ(c.p_value, 0.625);
  // (1.5 - 3.5) / 12 and 1.959964 sqrt(5 - 4 / 12) / 12
  EXPECT_NEAR(c.interval_95->low, -1.0 / 6 - 0.352834, 1e-5);
  EXPECT_NEAR(c.interval_95->high, -1.0 / 6 + 0.352834, 1e-5);
}

TEST_F(Comparison, TimesOfTenPairs) {
  const batch::Change c = TimesOf(TenPairs());
  EXPECT_EQ(c.pairs, 6);
  EXPECT_DOUBLE_EQ(*c.a, 10);
  EXPECT_DOUBLE_EQ(*c.difference, 1.5);
  // four slower and one faster: P(at most 1 of 5 fair flips), twice
  EXPECT_DOUBLE_EQ(c.p_value, 2 * (1.0 + 5) / 32);
  // of six values only the outermost two bound the median with 95 %: 2 / 64 are outside
  ASSERT_TRUE(c.interval_95);
  EXPECT_DOUBLE_EQ(c.interval_95->low, -1);
  EXPECT_DOUBLE_EQ(c.interval_95->high, 4);
}

// Only pairs in which both docked and both have it are compared.
TEST_F(Comparison, AMetricThatOneTrialOfAPairLacks) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<TrialPair> pairs = TenPairs();
  EXPECT_EQ(TimesOf(pairs).pairs, 6);
  pairs[0].b.time_s = kNone;
  EXPECT_EQ(TimesOf(pairs).pairs, 5);
  pairs[1].a.time_s = kNone;
  EXPECT_EQ(TimesOf(pairs).pairs, 4);
  EXPECT_DOUBLE_EQ(*TimesOf(pairs).a, 10);
}

TEST_F(Comparison, TrialsPairBySeedAndParameters) {
  const batch::ResultStore a = Store("a.db", {{1, true, 30}, {2, true, 31}, {1, false, 60, "20"}});
  const batch::ResultStore b = Store("b.db", {{1, false, 60, "20"}, {3, true, 1}, {1, true, 33}});
  const auto pairs = PairTrials(a, b, {});
  ASSERT_EQ(pairs.size(), 2u);
  const std::vector<batch::Change> changes =
      ComparePairs(pairs, {.by = {"water.milk_ml_m3"}}).changes;
  EXPECT_EQ(changes[0].group, "all");
  EXPECT_EQ(changes[0].pairs, 2);
  const auto ten = std::ranges::find(changes, "water.milk_ml_m3=10", &batch::Change::group);
  EXPECT_EQ(ten->pairs, 1);
  EXPECT_EQ(ten[1].measure, "time_s");
  EXPECT_EQ(ten[1].a, 30);
  EXPECT_EQ(ten[1].b, 33);
  const auto twenty = std::ranges::find(changes, "water.milk_ml_m3=20", &batch::Change::group);
  EXPECT_EQ(twenty->measure, "success_rate");
  EXPECT_THAT(report::Text(ReportOf(Compare({a, "a.db"}, {b, "b.db"}, {}))),
              HasSubstr("1 trials of A and 1 of B are left out"));
}

TEST_F(Comparison, WhatDiffersOnPurposeIsIgnored) {
  const batch::ResultStore a = Store("a.db", {{1, true, 30}}),
                           b = Store("b.db", {{1, true, 30, "20"}});
  EXPECT_THAT(MessageOf([&] { PairTrials(a, b, {}); }),
              HasSubstr("--ignore those in which they are meant to differ, of water.milk_ml_m3"));
  EXPECT_EQ(PairTrials(a, b, {.by = {}, .ignore = {"water.milk_ml_m3"}}).size(), 1u);
  // a parameter of one set only, in which its trials differ
  const batch::ResultStore c = Store("c.db", {{1, true, 30}, {1, true, 30, "20"}});
  const batch::ResultStore plain = Store("plain.db", {{1, true, 30}}, {});
  EXPECT_THAT(MessageOf([&] { PairTrials(c, plain, {}); }),
              HasSubstr("they differ in water.milk_ml_m3, which tells no pairs apart"));
  EXPECT_THAT(MessageOf([&] { PairTrials(c, c, {.by = {}, .ignore = {"water.milk_ml_m3"}}); }),
              HasSubstr("or --ignore leaves it out"));
  EXPECT_THAT(MessageOf([&] { PairTrials(a, b, {.by = {"water.milk"}, .ignore = {}}); }),
              HasSubstr("did you mean water.milk_ml_m3?"));
}

// What one set varies the trials of the other have a value of, by their scenario.
TEST_F(Comparison, AKeyThatOneSetVariesAndTheOtherSetsIsMatchedByItsValue) {
  const auto store = [&](const std::string& name, const std::string& plan_text) {
    const batch::Plan plan("schema_version: 1\nscenario: pool_active\nseeds: 2\n" + plan_text,
                           "plan");
    std::vector<batch::StoredTrial> trials;
    for (int64_t number = 0; number < plan.trials(); ++number) {
      const batch::TrialSpec spec = plan.Trial(number);
      trials.push_back({.trial = number, .parameters = spec.parameters, .record = {}});
      trials.back().record.seed = spec.seed;
      End(&trials.back().record, trial::Failure::kNone);
    }
    return testing::StoreOf(File(name), HeaderOf(plan, {}), trials);
  };
  const batch::ResultStore both = store("both.db", "grid: {control.use: [pid, lqg]}\n"),
                           one = store("one.db", "set: {control.use: lqg}\n"),
                           none = store("none.db", "set: {control.use: p_voltage}\n"),
                           milk = store("milk.db",
                                        "set: {control.use: lqg}\ngrid: {water.milk_ml_m3: "
                                        "[20, 1.0]}\n"),
                           set = store("set.db",
                                       "set: {water: {milk_ml_m3: 1}}\ngrid: {control.use: [pid, "
                                       "lqg]}\n");
  for (const auto& [a, b, first] : {std::tuple{&both, &one, 2}, {&set, &milk, 2}}) {
    const auto pairs = PairTrials(*a, *b, {});
    ASSERT_EQ(pairs.size(), 2u);
    EXPECT_EQ(pairs[0].trial_a, first) << "of lqg";
    EXPECT_EQ(pairs[0].parameters[0], (batch::Parameter{"control.use", "lqg"}));
  }
  EXPECT_EQ(PairTrials(one, both, {.by = {"control.use"}}).size(), 2u);
  EXPECT_THAT(MessageOf([&] { PairTrials(both, none, {}); }),
              HasSubstr("meant to differ, of control.use"));
  EXPECT_THAT(MessageOf([&] { PairTrials(both, one, {.ignore = {"control.use"}}); }),
              HasSubstr("several trials"));
}

// Fifteen seeds at each of two values of milk: at 100 twelve are lost, at 20 one is gained.
std::vector<TrialPair> TwoGroups() {
  std::vector<TrialPair> pairs;
  for (int i = 0; i < 30; ++i) {
    const bool many = i < 15;
    TrialPair& pair = pairs.emplace_back();
    pair.parameters = {{"water.milk_ml_m3", many ? "100" : "20"}};
    pair.a.seed = pair.b.seed = i % 15;
    pair.trial_a = i;
    pair.trial_b = 100 + i;
    End(&pair.a, many || i < 29 ? trial::Failure::kNone : trial::Failure::kTimeout);
    End(&pair.b, many && i < 12 ? trial::Failure::kCollision : trial::Failure::kNone);
    pair.a.time_s = 10 + 0.01 * i;
    pair.b.time_s = pair.a.time_s + 1;
    pair.a.tracking_rms_m = std::numeric_limits<double>::quiet_NaN();
  }
  return pairs;
}

compare::Comparison Compared(const std::vector<TrialPair>& pairs,
                             const std::vector<std::string>& by) {
  compare::Comparison c = ComparePairs(pairs, {.by = by});
  c.a = "a.db";
  c.b = "b.db";
  c.build_a = "1";
  c.build_b = "2";
  return c;
}

TEST_F(Comparison, GroupsStandInTheOrderOfTheirNumbersAfterAll) {
  std::vector<std::string> names;
  for (const batch::Change& change : Compared(TwoGroups(), {"water.milk_ml_m3"}).changes)
    if (change.is_rate()) names.push_back(change.group);
  EXPECT_THAT(names, ::testing::ElementsAre("all", "water.milk_ml_m3=20", "water.milk_ml_m3=100"));
}

// The rows of all pairs are a family of tests, those of the groups another; in each success and all
// medians.
TEST_F(Comparison, SignificantByHolmInFamilies) {
  const compare::Comparison c = Compared(TwoGroups(), {"water.milk_ml_m3"});
  const auto change = [&](const std::string& group, const std::string& measure) {
    for (const batch::Change& of : c.changes)
      if (of.group == group && of.measure == measure) return of;
    throw std::runtime_error("no " + measure + " of " + group);
  };
  const std::string little = "water.milk_ml_m3=20", much = "water.milk_ml_m3=100";
  EXPECT_DOUBLE_EQ(change(much, "success_rate").p_value, 2.0 / 4096);
  EXPECT_TRUE(change(much, "success_rate").significant);
  EXPECT_EQ(change(little, "success_rate").p_value, 1);
  EXPECT_FALSE(change(little, "success_rate").significant);
  // 12 lost and 1 gained: 2 (1 + 13) / 2^13
  EXPECT_DOUBLE_EQ(c.all().p_value, 28.0 / 8192);
  EXPECT_TRUE(c.all().significant);
  // 14 of 14 slower, but 3 of 3 only where much is lost
  EXPECT_TRUE(change(little, "time_s").significant);
  EXPECT_FALSE(change(much, "time_s").significant);
  EXPECT_THROW(change(much, "tracking_rms_m"), std::runtime_error) << "no pair has one";
}

// Six lost of 32: p = 0.031. Grouped, no row is significant; the verdict is of all pairs.
TEST_F(Comparison, ByAddsRowsAndChangesNoVerdict) {
  std::vector<TrialPair> pairs(32);
  for (int i = 0; i < 32; ++i) {
    TrialPair& pair = pairs[static_cast<size_t>(i)];
    pair.parameters = {{"water.milk_ml_m3", std::to_string(i % 4)}};
    pair.a.seed = pair.b.seed = i;
    End(&pair.a, trial::Failure::kNone);
    End(&pair.b, i < 6 ? trial::Failure::kTimeout : trial::Failure::kNone);
  }
  const compare::Comparison plain = Compared(pairs, {}), by = Compared(pairs, {"water.milk_ml_m3"});
  EXPECT_EQ(ReportOf(plain).verdict.word, "succeeds less often");
  EXPECT_EQ(ReportOf(by).verdict.word, "succeeds less often");
  EXPECT_EQ(ReportOf(by).verdict.reason, ReportOf(plain).verdict.reason);
  for (const batch::Change& change : by.changes)
    EXPECT_EQ(change.significant, change.group == "all" && change.is_rate());
}

TEST_F(Comparison, TheReportSaysWhatChangedAndWhichSeedsChanged) {
  compare::Comparison c = Compared(TwoGroups(), {"water.milk_ml_m3"});
  c.a = "my a.db";
  const report::Report r = ReportOf(c);
  EXPECT_EQ(r.verdict.word, "succeeds less often");
  EXPECT_EQ(r.verdict.tone, report::Tone::kBad);
  const std::string text = report::Text(r);
  EXPECT_THAT(text, HasSubstr("succeeds less often: b.db against my a.db"));
  EXPECT_THAT(text, ContainsRegex("pairs +30\n"));
  EXPECT_THAT(text, ContainsRegex("water milk 100 ml/m³ +success, % +100 +20 +-80 .-.* 15 +12 +0 "
                                  "+4.9e-04 +significant"));
  EXPECT_THAT(text, ContainsRegex("all +success, % .* 0.003 +significant"));
  EXPECT_THAT(text, ContainsRegex("20 ml/m³ +time, s +10.2[12] +11.2[12] +\\+1 \\[\\+1, \\+1\\] "
                                  "+14 .*significant"));
  EXPECT_THAT(text, Not(HasSubstr("tracking"))) << "no pair has one";
  EXPECT_THAT(text, ContainsRegex("\n14 +gained +water milk 20 ml/m³ +timeout +29 +129\n"));
  EXPECT_THAT(
      text,
      HasSubstr("turbidock compare 'my a.db' b.db --by water.milk_ml_m3 --out compare.html\n"));
  // significant rows first, success before times
  EXPECT_LT(text.find("all      "), text.find("time, s"));
  // the seed opens its pair
  const report::Table& flipped = *r.sections.back().table;
  ASSERT_EQ(flipped.rows().size(), 13u);
  EXPECT_EQ(flipped.rows()[0][0].link, "0-100");
  EXPECT_EQ(flipped.rows()[0][1].text, "lost");
  EXPECT_EQ(flipped.rows()[0][2].text, "water milk 100 ml/m³");
  EXPECT_EQ(flipped.rows()[12][0].link, "29-129");
}

// 12 of 15 pairs lost at 100 ml/m3 are 80 points; a second more of 10.21 s are 9.8 %.
TEST_F(Comparison, ThePictureHasTheWorstOnTopAndItsRowsLeadToTheSeeds) {
  const report::Report r = ReportOf(Compared(TwoGroups(), {"water.milk_ml_m3"}));
  const auto section = std::ranges::find(r.sections, "What changed", &report::Section::title);
  ASSERT_NE(section, r.sections.end());
  const report::Panel& panel = section->panels.at(0);
  ASSERT_GE(panel.y.names.size(), 4u);
  EXPECT_EQ(panel.y.names[0], "water milk 100 ml/m³: success");
  EXPECT_GT(panel.y.low, panel.y.high) << "downwards";
  std::map<double, report::Sample> rows;
  for (const report::Series& series : panel.series)
    for (const report::Sample& sample : series.points) rows[sample.y] = sample;
  ASSERT_EQ(rows.size(), panel.y.names.size());
  EXPECT_NEAR(rows[0].x, 80, 1e-9);
  for (auto row = std::next(rows.begin()); row != rows.end(); ++row)
    EXPECT_LE(row->second.x, std::prev(row)->second.x);
  for (const auto& [y, sample] : rows)
    EXPECT_FALSE(sample.low > sample.x || sample.x > sample.high);  // some have no interval
  EXPECT_EQ(panel.series[0].name, "worse");
  EXPECT_EQ(panel.series[0].links[0], "#Seeds that changed#water milk 100 ml/m³");
  const auto slower = std::ranges::find(panel.y.names, "water milk 20 ml/m³: time");
  ASSERT_NE(slower, panel.y.names.end());
  EXPECT_NEAR(rows[static_cast<double>(slower - panel.y.names.begin())].x, 9.8, 0.1);
}

TEST(ValueText, IsInTheUnitOfItsTitleAlsoInAList) {
  EXPECT_EQ(batch::ValueText("start.lateral_m", "0.1"), "100");
  EXPECT_EQ(batch::ValueText("start.lateral_m", "[0.10, 0.2]"), "[100, 200]");
  EXPECT_EQ(batch::ValueText("control.use", "[pid, lqg]"), "[pid, lqg]");
}

TEST_F(Comparison, WithoutAChangeItSaysSo) {
  std::vector<TrialPair> pairs = TwoGroups();
  for (TrialPair& pair : pairs) pair.b = pair.a;
  const report::Report r = ReportOf(Compared(pairs, {}));
  EXPECT_EQ(r.verdict.word, "no significant change in success");
  EXPECT_THAT(report::Text(r), HasSubstr("None: every seed ended the same way on both sides."));
  // of 15 seeds of which none differs, with a probability of 80 % six are lost of so many
  EXPECT_THAT(report::Text(r), ContainsRegex("smallest change noticed +4[0-9].[0-9] points"));
}

TEST_F(Comparison, TheDocumentHasTheNumbersAndTheReport) {
  const compare::Comparison c = Compared(TwoGroups(), {"water.milk_ml_m3"});
  const report::Json json = report::Document(ReportOf(c), c);
  EXPECT_EQ(json["kind"], "comparison");
  EXPECT_EQ(json["schema_version"], 1);
  for (const char* key :
       {"a", "b", "build_a", "build_b", "differences", "changes", "flips", "report"})
    EXPECT_TRUE(json.contains(key)) << key;
  const report::Json& all = json["changes"][0];
  EXPECT_EQ(all["group"], "all");
  EXPECT_EQ(all["measure"], "success_rate");
  EXPECT_EQ(all["significant"], true);
  EXPECT_EQ(json["changes"][1]["measure"], "time_s");
  ASSERT_EQ(json["flips"].size(), 13u);
  EXPECT_EQ(json["flips"][0]["why"], "collision");
  EXPECT_EQ(json["flips"][12]["trial_b"], 129);
}

// A reader sees first in what the two sides differ, and in what their pairs did.
TEST_F(Comparison, BeginsWithWhatDiffers) {
  const std::string plan = "seeds: 3\nset: {control.use: pid}\nresolved_scenarios:\n  pool: |\n",
                    tail = "models_digest: \"1\"\n";
  const batch::PlanDifferences differences = batch::DifferencesOf(
      plan + "    sea: {state: calm}\n    duration_s: 60\n" + tail,
      plan + "    sea: {state: rough}\n    duration_s: 60\n    day: true\n" + tail);
  EXPECT_EQ(differences, (batch::PlanDifferences{{"scenario.day", {"-", "true"}},
                                                 {"scenario.sea.state", {"calm", "rough"}}}));
  compare::Comparison c = Compared(TwoGroups(), {});
  c.differences = differences;
  const report::Report r = ReportOf(c);
  EXPECT_EQ(r.sections[0].title, "What differs");
  const std::string text = report::Text(r);
  EXPECT_THAT(text, ContainsRegex("file +a.db +b.db\nbuild +1 +2\n"));
  EXPECT_THAT(text, ContainsRegex("sea state +calm +rough +scenario.sea.state\n"));
}

// One trial, and batches that share no seed, say so.
TEST_F(Comparison, OnePairAndNoneSayWhatIsMissing) {
  const batch::ResultStore a = Store("a.db", {{1, true, 30}}), b = Store("b.db", {{1, false, 60}}),
                           other = Store("other.db", {{2, true, 30}});
  EXPECT_THAT(MessageOf([&] { PairTrials(a, other, {}); }),
              HasSubstr("has the seed of one of the other; run both with the same master_seed"));
  const std::string text = report::Text(ReportOf(Compare({a, "a.db"}, {b, "b.db"}, {})));
  EXPECT_THAT(text, HasSubstr("no significant change in success"));
  EXPECT_THAT(text, ContainsRegex("smallest change noticed +none"));
  EXPECT_THAT(text, HasSubstr("So few pairs could not have shown any change."));
  EXPECT_THAT(text, ContainsRegex("not varied +vehicle, station, lights, cameras, control, faults"))
      << "water is within each, the sea between the two";
}

TEST_F(Comparison, TheFigureIsDrawnAlsoWhereNothingDocks) {
  std::vector<TrialPair> pairs = TenPairs();
  const std::string path = (folder_ / "figure.png").string();
  const auto draw = [&] {
    media::WriteFigure(path, media::FigureOf(ReportOf(Compared(pairs, {}))));
    EXPECT_GT(std::filesystem::file_size(path), 1000u);
  };
  draw();
  for (TrialPair& pair : pairs) End(&pair.a, trial::Failure::kTimeout);
  draw();
}

}  // namespace
}  // namespace turbidock::compare
