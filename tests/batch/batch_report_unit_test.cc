// The report of a file of trials: its state, its axes, its groups.

#include "experiments/batch/batch_report.h"

#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/report/report.h"
#include "experiments/report/report_json.h"
#include "experiments/statistics/paired_tests.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"
#include "tests/support/stored_trials.h"

namespace turbidock::batch {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

class BatchReport : public testing::OwnFolder {
 protected:
  // A batch of so many trials, of which some are stored: two controllers over four values of milk,
  // of which no trial docks from 40 on.
  ResultStore Store(int64_t trials, int64_t stored,
                    const std::vector<std::string>& keys = {"water.milk_ml_m3", "control.use"}) {
    StoreHeader header;
    // no drawn key is in the grid
    std::vector<std::string> grid;
    if (std::ranges::count(keys, "water.milk_ml_m3") > 0)
      grid.emplace_back("water.milk_ml_m3: [0, 20, 40, 60]");
    if (std::ranges::count(keys, "control.use") > 0) grid.emplace_back("control.use: [pid, lqg]");
    const int64_t cells = grid.size() == 2 ? 8 : grid.empty() ? 1 : 2;
    header.plan = fmt::format("description: murky\nseeds: {}\ngrid: {{{}}}\n", trials / cells,
                              fmt::join(grid, ", "));
    header.build = "test 1";
    header.trials = trials;
    header.keys = keys;
    ResultStore store = ResultStore::Write(file_, header);
    for (int64_t i = 0; i < stored; ++i) {
      const int64_t milk = 20 * (i % 4);
      StoredTrial trial{.trial = i, .parameters = {}, .record = {}};
      for (const std::string& key : keys)
        trial.parameters.push_back({key, key == "water.milk_ml_m3" ? std::to_string(milk)
                                         : i % 8 < 4               ? "pid"
                                                                   : "lqg"});
      trial::TrialRecord& r = trial.record;
      r.seed = i;
      testing::End(&r, milk < 40 ? trial::Failure::kNone : trial::Failure::kCollision);
      r.time_s = 10 + static_cast<double>(i % 8);
      r.final_error_true.y_m = 0.003;
      store.Add(trial);
    }
    return store;
  }
  BatchSummary Summary(const ResultStore& store, const BatchReportOptions& options = {}) const {
    return SummaryOf(store, file_, options);
  }

  const std::string file_ = File("b.db");
};

TEST_F(BatchReport, SaysHowFarItIsAndWhatCameOut) {
  { const ResultStore written = Store(32, 24); }
  const ResultStore store = ResultStore::Read(file_);
  const std::string text = report::Text(ReportOf(Summary(store)));
  EXPECT_THAT(text, HasSubstr("partial: murky\n"));
  EXPECT_THAT(text, HasSubstr("written by test 1. Not running: start it again to finish it."));
  EXPECT_THAT(text, ContainsRegex("trials +24 of 32\n"));
  EXPECT_THAT(text, ContainsRegex("success +50 % \\[31, 69\\]"));
  EXPECT_THAT(text, ContainsRegex("true error when docked +y 3.0, z 0.0 mm"));
  EXPECT_THAT(text, ContainsRegex("failures +12 collision\n"));
  EXPECT_THAT(text, HasSubstr("pid falls to 50 % at 30 ["));
  EXPECT_THAT(text, HasSubstr("By water milk, control\n"));
  EXPECT_THAT(text, ContainsRegex("water milk +15 to 45 ml/m³ +>999 "));
}

TEST_F(BatchReport, OfTrialsThatSayNothingOfDockingTellsNoRate) {
  ResultStore store = Store(8, 0);
  {
    StoredTrial trial{.parameters = {{"water.milk_ml_m3", "0"}, {"control.use", "pid"}},
                      .record = {}};
    trial.record.outcome = trial::Outcome::kNoAnswer;
    trial.record.failure = trial::Failure::kNoAnswer;
    for (; trial.trial < 8; ++trial.trial) store.Add(trial);
  }
  for (const std::vector<std::string>& by : {std::vector<std::string>{}, {"control.use"}}) {
    const std::string text = report::Text(ReportOf(Summary(store, {.by = by})));
    EXPECT_THAT(text, Not(HasSubstr("nan")));
    EXPECT_THAT(text, HasSubstr("8 no answer"));
  }
}

TEST_F(BatchReport, KnowsWhenItIsCompleteRunningOrEmpty) {
  {
    const ResultStore held = Store(8, 8);
    const report::Verdict verdict = ReportOf(Summary(held)).verdict;
    EXPECT_THAT(verdict.word, ContainsRegex("^[0-9]+ % succeed \\[[0-9]+ to [0-9]+\\]$"));
    EXPECT_THAT(verdict.reason, HasSubstr("written by test 1. Complete."));
    EXPECT_EQ(ResultJson(Summary(held))["running"],
              false);  // though its runner holds the file still
  }
  std::filesystem::remove(file_);
  const ResultStore store = Store(8, 0);
  const report::Report report = ReportOf(Summary(store));
  EXPECT_EQ(report.verdict.word, "running");
  EXPECT_THAT(report.missing, ElementsAre("No trials: none was stored yet"));
  EXPECT_TRUE(report.sections.empty());
}

TEST_F(BatchReport, DrawsOverItsFirstNumberByTheNextOfFewValues) {
  const ResultStore store = Store(32, 32);
  const BatchSummary summary = Summary(store);
  EXPECT_EQ(summary.over, "water.milk_ml_m3");
  EXPECT_THAT(summary.curves_by, ElementsAre("control.use"));
  EXPECT_EQ(summary.curves.size(), 2u);
  EXPECT_THAT(summary.keys, ElementsAre("water.milk_ml_m3", "control.use"));
  // what was asked for: the table has a row for each value, also of what it is drawn over
  const BatchSummary over = Summary(store, {.over = "water.milk_ml_m3"});
  EXPECT_EQ(over.curves.size(), 1u);
  EXPECT_THAT(over.keys, ElementsAre("water.milk_ml_m3"));
  EXPECT_EQ(over.groups.size(), 4u);
  const BatchSummary both = Summary(store, {.by = {"water.milk_ml_m3", "control.use"}});
  EXPECT_EQ(both.groups.size(), 8u);
  EXPECT_THAT(both.curves_by, ElementsAre("control.use"));
  // what is no parameter groups the table alone
  const BatchSummary by_failure = Summary(store, {.by = {"failure"}});
  EXPECT_EQ(by_failure.groups.size(), 2u);
  EXPECT_THAT(by_failure.curves_by, ElementsAre("control.use"));
  EXPECT_THAT(
      testing::MessageOf([&] { Summary(store, {.by = {"control.use"}, .over = "control.use"}); }),
      HasSubstr("--by control.use: is what success is drawn over"));
  EXPECT_THAT(testing::MessageOf([&] { Summary(store, {.over = "control.use"}); }),
              HasSubstr("is no number"));
  EXPECT_THAT(testing::MessageOf([&] { Summary(store, {.by = {"nonsense"}}); }),
              HasSubstr("cannot be grouped by this"));
}

// What each trial draws is no way to group them, however few its values.
TEST_F(BatchReport, NeverGroupsByWhatWasDrawn) {
  const ResultStore store = Store(12, 12, {"start.x_m"});
  const BatchSummary summary = Summary(store);
  EXPECT_TRUE(summary.keys.empty());
  EXPECT_TRUE(summary.curves.empty());
  EXPECT_EQ(summary.over, "");
  EXPECT_EQ(Summary(store, {.by = {"start.x_m"}}).groups.size(), 2u) << "unless it is asked for";
}

TEST_F(BatchReport, NamesItsKeysAndTheirUnits) {
  const std::string text = report::Text(ReportOf(Summary(Store(32, 32))));
  EXPECT_THAT(text, HasSubstr("Success over water milk, by control\n"));
  EXPECT_THAT(text, HasSubstr("water milk, ml/m³"));
  EXPECT_THAT(text, Not(HasSubstr("_ml_m3")));
  EXPECT_EQ(NameOfKey("sea.current.surface_velocity_mps[1]").Title(),
            "current surface velocity y, m/s");
  EXPECT_EQ(ValueText("start.distance_min_m", "0.6"), "600");
  EXPECT_EQ(ValueText("scenario", "sea_night_active"), "sea_night_active");
}

TEST_F(BatchReport, SaysWhatItCouldNotTell) {
  const std::string text = report::Text(ReportOf(Summary(Store(80, 80))));
  // eight groups of ten, of which half dock, so that half of the pairs differ by chance
  const double seen = *statistics::LeastDifferenceSeen(10, 0.5);
  EXPECT_THAT(text,
              HasSubstr(fmt::format(
                  "Two groups of 10 trials must differ in success by {:.0f} percentage points",
                  100 * seen)));
  EXPECT_THAT(text, HasSubstr("Not varied: vehicle, station, sea, lights, cameras, faults.\n"));
}

TEST_F(BatchReport, WhatScenariosOfCasesDifferInIsNotCalledNotVaried) {
  const auto rest = [](const std::string& cases) {
    StoreHeader header;
    header.plan = "cases: {a: {sea.state: rough}, b: " + cases + "}\n";
    return fmt::format("{}", fmt::join(NotVaried(header), ", "));
  };
  EXPECT_EQ(rest("{}"), "vehicle, station, water, lights, cameras, control, faults");
  EXPECT_THAT(rest("{scenario: pool_active}"),
              EndsWith("faults, but for what its scenarios differ in"));
}

TEST_F(BatchReport, GroupsByHowTrialsEndedAreNoConditionsToTellApart) {
  const ResultStore store = Store(80, 80);
  EXPECT_THAT(report::Text(ReportOf(Summary(store, {.by = {"control.use", "failure"}}))),
              AllOf(Not(HasSubstr("Two groups")), HasSubstr("Not varied: vehicle")));
}

TEST_F(BatchReport, SaysWhereItCouldTellNothing) {
  EXPECT_THAT(report::Text(ReportOf(Summary(Store(8, 8)))),
              HasSubstr("Two groups of 1 trial cannot be told apart by success with 80 %"));
}

TEST_F(BatchReport, CountsOnlyBoundariesThatAreKnownToTheWidth) {
  StoreHeader header;
  header.plan =
      "ranges: {water.milk_ml_m3: {from: 0, to: 80, success: falls}}\n"
      "find: {width: 0.2, trials: 100}\n";
  header.keys = {"water.milk_ml_m3"};
  header.trials = 41 * kMostOfCell;
  ResultStore store = ResultStore::Write(file_, header);
  const auto known = [&] {
    for (const report::Fact& fact : ReportOf(Summary(store)).facts)
      if (fact.label == "boundaries") return fact.value;
    return std::string("no fact");
  };
  TrialScheduler scheduler(RuleOf(header), {});
  const auto run = [&](int64_t most) {
    for (int64_t i = 0; i < most; ++i) {
      const auto number = scheduler.Next();
      if (!number) return;
      const int64_t milk = 2 * (*number % 41);
      StoredTrial trial{.trial = *number,
                        .cell = *number % 41,
                        .sample = *number / 41,
                        .parameters = {{"water.milk_ml_m3", std::to_string(milk)}},
                        .record = {}};
      testing::End(&trial.record, milk < 40 ? trial::Failure::kNone : trial::Failure::kCollision);
      store.Add(trial);
      scheduler.Add(*number, milk < 40);
    }
  };
  run(4);
  EXPECT_EQ(known(), "0 of 1 known to 20 % of the ranges");
  run(100);
  EXPECT_EQ(known(), "1 of 1 known to 20 % of the ranges");
}

TEST_F(BatchReport, APlanThatCannotBeReadHindersNothing) {
  BatchSummary summary = Summary(Store(80, 80));
  summary.header.plan = "{";
  const std::string text = report::Text(ReportOf(summary));
  EXPECT_THAT(text, HasSubstr("percentage points"));
  EXPECT_THAT(text, Not(HasSubstr("Not varied")));
}

TEST_F(BatchReport, WithoutANumberThatVariesNothingIsDrawn) {
  const ResultStore store = Store(8, 8, {"control.use"});
  EXPECT_TRUE(Summary(store).curves.empty());
  EXPECT_THAT(report::Text(ReportOf(Summary(store))), Not(HasSubstr("Success over")));
}

TEST_F(BatchReport, TheDocumentHasTheNumbersAndTheReport) {
  const ResultStore store = Store(32, 32);
  const BatchSummary summary = Summary(store, {.by = {"control.use"}});
  const report::Json json = report::Document(ReportOf(summary), ResultJson(summary));
  EXPECT_EQ(json["kind"], "batch");
  for (const char* key : {"schema_version", "plan_hash", "build", "shard", "trials", "done",
                          "running", "groups", "success", "report"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_FALSE(json.contains("precision"));
  EXPECT_EQ(json["groups"][0]["group"]["control.use"], "lqg");
  EXPECT_EQ(json["success"]["over"], "water.milk_ml_m3");
  EXPECT_EQ(json["success"]["curves"][1]["name"], "pid");
}

}  // namespace
}  // namespace turbidock::batch
