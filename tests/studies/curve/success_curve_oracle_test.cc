// Success and the estimate's error over one key, against numbers worked out by hand.

#include "experiments/studies/curve/success_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sim/base/check.h"
#include "tests/support/message_of.h"

namespace turbidock::curve {
namespace {

using ::testing::HasSubstr;

// Docked with the estimate off by this distance [m]; not docked: negative.
farm::StoredTrial Trial(const std::string& milk, const std::string& marker, double off_m) {
  farm::StoredTrial trial;
  trial.parameters = {{"water.milk_ml_m3", milk}, {"scenario", marker}};
  trial::TrialRecord& r = trial.record;
  const bool docked = off_m >= 0;
  r.outcome = docked ? trial::Outcome::kDocked : trial::Outcome::kTimeout;
  r.failure = docked ? trial::Failure::kNone : trial::Failure::kTimeout;
  r.docked = r.inserted = docked;
  // off along all axes, and both off the desired pose
  r.final_error_true.x_m = 0.02;
  r.final_error_estimated.x_m = 0.02 + 0.6 * off_m;
  r.final_error_estimated.z_m = -0.8 * off_m;
  return trial;
}

const std::vector<farm::StoredTrial> kTrials = {
    Trial("20", "active", -1),     Trial("0", "active", 0.001),  Trial("0", "active", 0.005),
    Trial("0", "active", 0.002),   Trial("20", "active", 0.007), Trial("40", "active", -1),
    Trial("0", "passive", 0.0015), Trial("20", "passive", -1)};

TEST(SuccessCurve, CountsAndMediansByDose) {
  const std::vector<SuccessCurve> curves = SuccessCurves(kTrials, "water.milk_ml_m3", "scenario");
  ASSERT_EQ(curves.size(), 2u);
  const SuccessCurve& active = curves[0];
  EXPECT_EQ(active.name, "active");
  ASSERT_EQ(active.points.size(), 3u);
  EXPECT_EQ(active.points[0].successes, 3);
  EXPECT_EQ(active.points[1].successes, 1);
  EXPECT_EQ(active.points[1].trials, 2);
  EXPECT_EQ(active.points[2].successes, 0);
  // a dose without a success has no error
  ASSERT_EQ(active.errors.size(), 2u);
  EXPECT_EQ(active.errors[0].dose, 0);
  EXPECT_NEAR(active.errors[0].median_m, 0.002, 1e-15);
  // too few for an interval: from the smallest to the largest
  EXPECT_NEAR(active.errors[0].interval_m.low, 0.001, 1e-15);
  EXPECT_NEAR(active.errors[0].interval_m.high, 0.005, 1e-15);
  EXPECT_EQ(active.errors[1].dose, 20);
  EXPECT_NEAR(active.errors[1].median_m, 0.007, 1e-15);
}

// Both strata of a plan: near ones dock, far ones do not.
std::vector<farm::StoredTrial> InStrata() {
  std::vector<farm::StoredTrial> trials;
  for (int i = 0; i < 38; ++i) {
    farm::StoredTrial trial = Trial("0", "active", i % 2 == 0 ? 0.001 : -1);
    trial.parameters.push_back({"stratum", i % 2 == 0 ? "near" : "far"});
    trial.parameters.push_back({"start.heading_rad", i < 19 ? "0" : "0.1"});  // drawn
    trials.push_back(trial);
  }
  return trials;
}

TEST(SuccessCurve, IntervalsAreOverTheStrataOfWholeCells) {
  const std::vector<statistics::Count> apart = {{19, 19}, {0, 19}};
  const auto interval = [](const std::string& over, const std::string& by) {
    return SuccessCurves(InStrata(), over, by)[0].points[0].wilson.AsList();
  };
  EXPECT_EQ(interval("water.milk_ml_m3", "scenario"),
            statistics::StratifiedInterval(apart).AsList());
  // What was drawn chooses trials, not cells: 10 of 19 docked among these.
  EXPECT_EQ(interval("start.heading_rad", "scenario"), statistics::WilsonInterval(10, 19).AsList());
  EXPECT_EQ(interval("water.milk_ml_m3", "start.heading_rad"),
            statistics::WilsonInterval(10, 19).AsList());
  EXPECT_EQ(interval("water.milk_ml_m3", "stratum"), statistics::WilsonInterval(0, 19).AsList());
}

TEST(SuccessCurve, SaysTheErrorsInWordsAndJson) {
  const std::vector<SuccessCurve> curves = SuccessCurves(kTrials, "water.milk_ml_m3", "scenario");
  const std::string table = SuccessTable("water.milk_ml_m3", curves);
  EXPECT_THAT(table, HasSubstr("2.0 [1.0, 5.0]"));
  EXPECT_THAT(table, HasSubstr("7.0 [7.0, 7.0]"));
  const auto json = nlohmann::json::parse(SuccessJson("water.milk_ml_m3", curves));
  EXPECT_NEAR(json[0]["points"][0]["position_error_m"]["median"].get<double>(), 0.002, 1e-12);
  EXPECT_FALSE(json[0]["points"][2].contains("position_error_m"));
}

TEST(SuccessCurve, ErrorsAreDrawnWhereTheyAreAskedFor) {
  const std::vector<SuccessCurve> curves = SuccessCurves(kTrials, "water.milk_ml_m3", "scenario");
  const auto drawn = [&](const char* name, bool with_errors) {
    const std::string path = ::testing::TempDir() + name;
    WriteSuccessFigure(path, "docking", "water.milk_ml_m3", curves, with_errors);
    std::ifstream file(path);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  EXPECT_THAT(drawn("errors.svg", true), HasSubstr("position error of the estimate"));
  EXPECT_THAT(drawn("alone.svg", false), ::testing::Not(HasSubstr("position error")));
}

TEST(SuccessCurve, RefusesAKeyThatIsNoNumber) {
  EXPECT_THAT(testing::MessageOf([] { SuccessCurves(kTrials, "scenario", ""); }),
              HasSubstr("'active' is no number"));
}

}  // namespace
}  // namespace turbidock::curve
