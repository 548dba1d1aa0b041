// Success and the estimate's error over one key, against numbers worked out by hand.

#include "experiments/batch/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/message_of.h"
#include "tests/support/stored_trials.h"

namespace turbidock::batch {
namespace {

using ::testing::HasSubstr;

// Docked with the estimate off by this distance [m]; not docked: negative.
StoredTrial Trial(const std::string& milk, const std::string& marker, double off_m) {
  StoredTrial trial;
  trial.parameters = {{"water.milk_ml_m3", milk}, {"scenario", marker}};
  trial::TrialRecord& r = trial.record;
  testing::End(&r, off_m >= 0 ? trial::Failure::kNone : trial::Failure::kTimeout);
  r.seed = std::lround(1e4 * off_m);  // one for each that docks
  // off along all axes, and both off the desired pose
  r.final_error_true.x_m = 0.02;
  r.final_error_estimated.x_m = 0.02 + 0.6 * off_m;
  r.final_error_estimated.z_m = -0.8 * off_m;
  return trial;
}

const std::vector<StoredTrial> kTrials = {
    Trial("20", "active", -1),     Trial("0", "active", 0.001),  Trial("0", "active", 0.005),
    Trial("0", "active", 0.002),   Trial("20", "active", 0.007), Trial("40", "active", -1),
    Trial("0", "passive", 0.0015), Trial("20", "passive", -1)};

// Both strata of a plan: near ones dock, far ones do not.
std::vector<StoredTrial> InStrata() {
  std::vector<StoredTrial> trials;
  for (int i = 0; i < 38; ++i) {
    StoredTrial trial = Trial("0", "active", i % 2 == 0 ? 0.001 : -1);
    trial.record.seed = i;
    trial.parameters.push_back({"stratum", i % 2 == 0 ? "near" : "far"});
    trial.parameters.push_back({"start.heading_rad", i < 19 ? "0" : "0.1"});  // drawn
    trials.push_back(trial);
  }
  return trials;
}

TEST(SuccessCurve, CountsAndMediansByDose) {
  const std::vector<SuccessCurve> curves = SuccessCurves(kTrials, "water.milk_ml_m3", {"scenario"});
  ASSERT_EQ(curves.size(), 2u);
  const SuccessCurve& active = curves[0];
  EXPECT_EQ(active.name, "active");
  ASSERT_EQ(active.points.size(), 3u);
  EXPECT_EQ(active.points[0].trials.successes, 3);
  EXPECT_EQ(active.points[1].trials.successes, 1);
  EXPECT_EQ(active.points[1].trials.trials, 2);
  EXPECT_EQ(active.points[2].trials.successes, 0);
  const Spread& error = active.points[0].trials.estimate_error_m;
  EXPECT_NEAR(*error.median, 0.002, 1e-15);
  EXPECT_NEAR(*error.q10, 0.0012, 1e-15);
  EXPECT_NEAR(*error.q90, 0.0044, 1e-15);
  EXPECT_EQ(active.points[2].trials.estimate_error_m.count, 0) << "no success";
}

TEST(SuccessCurve, SeveralKeysNameACurveTogether) {
  const auto curves = SuccessCurves(InStrata(), "water.milk_ml_m3", {"scenario", "stratum"});
  ASSERT_EQ(curves.size(), 2u);
  EXPECT_EQ(curves[0].name, "active, far");
  EXPECT_EQ(curves[1].points[0].trials.successes, 19);
}

TEST(SuccessCurve, ANumberAloneSaysOfWhat) {
  std::vector<StoredTrial> trials = InStrata();
  for (StoredTrial& trial : trials)
    trial.parameters.push_back({"sea.current.gust_std_mps", "0.05"});
  EXPECT_EQ(SuccessCurves(trials, "water.milk_ml_m3", {"scenario", "sea.current.gust_std_mps"})
                .at(0)
                .name,
            "active, current gust std 0.05 m/s");
}

// Success that rises: 0 of 10, then 10 of 10.
TEST(SuccessCurve, SaysWhetherSuccessFallsOrRises) {
  const auto text = [](const char* docks, const char* fails) {
    std::vector<StoredTrial> trials;
    for (int i = 0; i < 10; ++i) {
      trials.push_back(Trial(docks, "active", 0.001));
      trials.push_back(Trial(fails, "active", -1));
    }
    const auto curves = SuccessCurves(trials, "water.milk_ml_m3", {});
    return SuccessSection("water.milk_ml_m3", {}, curves).lines.at(0);
  };
  EXPECT_THAT(text("0", "20"), HasSubstr("success falls to 50 % at 10 ["));
  EXPECT_THAT(text("0", "20"), HasSubstr("] ml/m³"));
  EXPECT_THAT(text("20", "0"), HasSubstr("rises to 50 % at 10 ["));
  EXPECT_EQ(text("20", "20"), "success has no trend that crosses 50 % within the values tried");
}

TEST(SuccessCurve, IntervalsAreOverTheStrataOfWholeCells) {
  const std::vector<statistics::Count> apart = {{19, 19}, {0, 19}};
  const auto interval = [](const std::string& over, const std::string& by) {
    return SuccessCurves(InStrata(), over, {by})[0].points[0].trials.wilson.AsList();
  };
  EXPECT_EQ(interval("water.milk_ml_m3", "scenario"),
            statistics::StratifiedInterval(apart).AsList());
  // What was drawn chooses trials, not cells: 10 of 19 docked among these.
  EXPECT_EQ(interval("start.heading_rad", "scenario"), statistics::WilsonInterval(10, 19).AsList());
  EXPECT_EQ(interval("water.milk_ml_m3", "start.heading_rad"),
            statistics::WilsonInterval(10, 19).AsList());
  EXPECT_EQ(interval("water.milk_ml_m3", "stratum"), statistics::WilsonInterval(0, 19).AsList());
}

TEST(IntervalText, SaysWhatMakesThemOthersThanWilsons) {
  EXPECT_EQ(IntervalText(Summarise(InStrata(), {"start.heading_rad"})), "95 %, Wilson's");
  EXPECT_THAT(IntervalText(Summarise(InStrata(), {"scenario"})),
              HasSubstr(", by the plan's strata"));
  std::vector<StoredTrial> alike;  // one seed in two cells, without strata
  for (int i = 0; i < 20; ++i)
    for (const char* milk : {"0", "10"}) {
      alike.push_back(Trial(milk, "active", i % 2 == 0 ? 0.001 : -1));
      alike.back().record.seed = i;
    }
  EXPECT_EQ(IntervalText(Summarise(alike, {})),
            "95 %, Wilson's, the trials of one seed counted as alike");
}

TEST(SuccessCurve, TheSectionDrawsRatesWithIntervals) {
  const std::vector<SuccessCurve> curves = SuccessCurves(kTrials, "water.milk_ml_m3", {"scenario"});
  const report::Section section = SuccessSection("water.milk_ml_m3", {"scenario"}, curves);
  EXPECT_EQ(section.title, "Success over water milk, by scenario");
  EXPECT_EQ(section.lines.size(), 2u);
  ASSERT_EQ(section.panels.size(), 1u);
  const report::Sample& first = section.panels[0].series[0].points[0];
  EXPECT_EQ(first.y, 100);
  EXPECT_EQ(first.low, 100 * statistics::WilsonInterval(3, 3).low);
}

// Only what was run is a mark; what is drawn between is said to be a fit.
TEST(SuccessCurve, NoLineGoesThroughValuesThatNobodyRan) {
  std::vector<StoredTrial> trials;
  for (int i = 0; i < 10; ++i) {
    trials.push_back(Trial("0", "active", 0.001));
    trials.push_back(Trial("10", "active", i < 5 ? 0.001 : -1));
    trials.push_back(Trial("20", "active", -1));
  }
  const report::Section section =
      SuccessSection("water.milk_ml_m3", {}, SuccessCurves(trials, "water.milk_ml_m3", {}));
  ASSERT_EQ(section.panels[0].series.size(), 2u);
  EXPECT_EQ(section.panels[0].series[0].mark, report::Mark::kBars);
  EXPECT_EQ(section.panels[0].series[0].points.size(), 3u);
  EXPECT_EQ(section.panels[0].series[1].mark, report::Mark::kDashes);
  EXPECT_THAT(section.note, HasSubstr("Dashed, between them: a logistic curve fitted"));
  EXPECT_EQ(section.panels[0].x.label, "water milk, ml/m³");
}

TEST(SuccessCurve, JsonHasTheErrorsOfSuccesses) {
  const report::Json json = SuccessCurves(kTrials, "water.milk_ml_m3", {"scenario"});
  const auto error_at = [&](int i) { return json[0]["points"][i]["trials"]["estimate_error_m"]; };
  EXPECT_EQ(json[0]["points"][1]["x"], 20);
  EXPECT_NEAR(error_at(0)["median"].get<double>(), 0.002, 1e-12);
  EXPECT_EQ(error_at(2)["count"], 0);
}

TEST(SuccessCurve, RefusesAKeyThatIsNoNumber) {
  EXPECT_THAT(testing::MessageOf([] { SuccessCurves(kTrials, "scenario", {}); }),
              HasSubstr("'active' is no number"));
}

}  // namespace
}  // namespace turbidock::batch
