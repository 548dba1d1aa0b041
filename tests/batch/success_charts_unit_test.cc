// Charts of success, ready to be chosen from.

#include "experiments/batch/success_charts.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "experiments/batch/summary.h"
#include "experiments/statistics/intervals.h"

namespace turbidock::batch {
namespace {

// 100 trials: water of two kinds, two strata that decide everything, a start that never repeats.
std::vector<StoredTrial> Trials() {
  std::vector<StoredTrial> trials;
  for (int i = 0; i < 100; ++i) {
    const bool near = i % 4 < 2;
    StoredTrial trial;
    trial.trial = i;
    trial.parameters = {{"water.milk_ml_m3", i % 2 == 0 ? "0" : "20"},
                        {"stratum", near ? "near" : "far"},
                        {"start.heading_rad", std::to_string(0.01 * i)}};
    trial.record.seed = i;
    trial.record.failure = near ? trial::Failure::kNone : trial::Failure::kTimeout;
    trials.push_back(trial);
  }
  return trials;
}

StoreHeader Header() {
  return {.kind = "batch",
          .plan = "description: murky\nseeds: 50\ngrid: {water.milk_ml_m3: [0, 20]}\n",
          .build = "test",
          .shard = {},
          .trials = 100,
          .keys = {"water.milk_ml_m3", "stratum", "start.heading_rad"}};
}

TEST(SuccessCharts, AreNarrowerByTheStrataWhereCellsAreWhole) {
  const SuccessCharts charts = ChartsOf(Header(), Trials());
  EXPECT_EQ(charts.over, "water.milk_ml_m3");
  EXPECT_EQ(charts.by, "") << "no curves by what was drawn";
  const report::Series& whole = charts.panels.at("water.milk_ml_m3|").series[0];
  ASSERT_EQ(whole.points.size(), 2u);
  const auto stratified =
      statistics::StratifiedInterval(std::vector<statistics::Count>{{25, 25}, {0, 25}});
  EXPECT_NEAR(whole.points[0].low, 100 * stratified.low, 1e-9);
  const auto plain = statistics::WilsonInterval(25, 50);
  EXPECT_LT(whole.points[0].high - whole.points[0].low, 80 * 2 * plain.half_width());
  // cells that a drawn start tells apart are not whole
  const report::Series& drawn = charts.panels.at("start.heading_rad|").series[0];
  const auto some = statistics::WilsonInterval(4, 9);
  for (const report::Sample& sample : drawn.points)
    EXPECT_GE(sample.high - sample.low, 100 * some.half_width());
}

TEST(SuccessCharts, APointsLinkSaysWhichTrialsItIsOf) {
  const SuccessCharts charts = ChartsOf(Header(), Trials());
  const report::Panel& panel = charts.panels.at("start.heading_rad|stratum");
  ASSERT_EQ(panel.series.size(), 2u);
  EXPECT_EQ(panel.series[0].name, "far");
  const auto axis = std::ranges::find(charts.axes, "start.heading_rad", &TrialAxis::key);
  ASSERT_NE(axis, charts.axes.end());
  EXPECT_EQ(axis->across.of.size(), 100u);
  EXPECT_LE(axis->across.names.size(), 13u) << "bins";
  EXPECT_LE(axis->lines.names.size(), 6u);
  for (const report::Series& series : panel.series)
    for (size_t i = 0; i < series.points.size(); ++i) {
      EXPECT_EQ(series.points[i].y, series.name == "near" ? 100 : 0);
      EXPECT_TRUE(series.links[i].ends_with(series.name == "near" ? ",1" : ",0"));
    }
}

TEST(SuccessCharts, LeaveOutWhatSaysNothingOfDocking) {
  std::vector<StoredTrial> trials = Trials();
  for (StoredTrial& trial : trials)
    if (trial.parameters[0].value == "20") trial.record.outcome = trial::Outcome::kNoAnswer;
  const auto charts = ChartsOf(Header(), trials);
  const report::Series& series = charts.panels.at("water.milk_ml_m3|").series[0];
  ASSERT_EQ(series.points.size(), 1u);
  EXPECT_EQ(series.points[0].x, 0);
}

TEST(SuccessCharts, WithoutDifferencesThereAreNone) {
  StoreHeader header = Header();
  header.keys.clear();
  EXPECT_TRUE(ChartsOf(header, std::vector<StoredTrial>(1)).over.empty());
}

TEST(FailureTable, ExplainsEachThatHappened) {
  GroupSummary group;
  group.trials = 4;
  group.failures = {{"timeout", 1}, {"jammed", 2}};
  group.successes = 1;
  const report::Section section = FailureTable(group);
  ASSERT_EQ(section.table->rows().size(), 2u);
  EXPECT_EQ(section.table->rows()[0][0].text, "jammed");
  EXPECT_EQ(section.table->rows()[0][2].text, "50.0");
  group.failures["no_answer"] = 1;  // which no rate counts
  EXPECT_EQ(FailureTable(group).table->rows()[0][2].text, "40.0");
  for (const auto& [failure, name] : EnumNames<trial::Failure>::kNames)
    EXPECT_GT(std::string(MeaningOf(failure)).size(), 5u) << name;
}

}  // namespace
}  // namespace turbidock::batch
