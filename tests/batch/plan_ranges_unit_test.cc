// Plans that look for a boundary over ranges: which trials they have, and what is said of bad ones.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "experiments/batch/batch.h"
#include "experiments/batch/plan.h"
#include "experiments/batch/store_header.h"
#include "experiments/config/yaml_fields.h"
#include "tests/support/message_of.h"

namespace turbidock::batch {
namespace {

using ::testing::HasSubstr;

Plan Make(const std::string& text, const PlanOverrides& overrides = {}) {
  return Plan("schema_version: 1\nscenario: pool_active\n" + text, "plan.yaml", overrides);
}

std::string ErrorOf(const std::string& text, const PlanOverrides& overrides = {}) {
  return testing::MessageOf([&] { Make(text, overrides); });
}

const std::string kMilk = "ranges: {water.milk_ml_m3: {from: 0, to: 80, success: falls}}\n";
const std::string kFind = "find: {rate: 0.8, width: 0.05}\n";

TEST(Ranges, AreALatticeOfCells) {
  const Plan plan = Make(
      "ranges:\n"
      "  water.milk_ml_m3: {from: 80, to: 0}\n"
      "  cameras.sensor.read_noise_electrons: {from: 1, to: 100, scale: logarithmic}\n" +
      kFind);
  EXPECT_EQ(plan.cells(), 21 * 21);
  EXPECT_EQ(plan.most(), 5000);
  const TrialSpec first = plan.FirstOf(0), last = plan.FirstOf(440), middle = plan.FirstOf(220);
  EXPECT_EQ(first.parameters[0].Assignment(), "water.milk_ml_m3=80");
  EXPECT_EQ(first.parameters[1].Assignment(), "cameras.sensor.read_noise_electrons=1");
  EXPECT_EQ(middle.parameters[0].Assignment(), "water.milk_ml_m3=40");
  EXPECT_EQ(middle.parameters[1].Assignment(), "cameras.sensor.read_noise_electrons=10");
  EXPECT_EQ(last.parameters[1].Assignment(), "cameras.sensor.read_noise_electrons=100");
  EXPECT_EQ(config::ValueOf(plan.ScenarioOf(middle), "water.milk_ml_m3"), "40");
  const search::BoundarySearch search = plan.envelope()->Search();
  EXPECT_EQ(search.rate, 0.8);
  EXPECT_EQ(search.width, 0.05);
}

// Else few seeds would decide the whole boundary.
TEST(Ranges, GiveEveryPlaceItsOwnSeedsInAllCasesTheSame) {
  const Plan plan = Make(kMilk + kFind + "cases: {a: {}, b: {trial.duration_s: 50}}\n");
  ASSERT_EQ(plan.cells(), 2 * 41);
  EXPECT_EQ(plan.FirstOf(7).seed, plan.FirstOf(41 + 7).seed);
  EXPECT_NE(plan.FirstOf(7).seed, plan.FirstOf(8).seed);
  const Plan apart = Make("common_seeds: false\n" + kMilk + kFind + "cases: {a: {}, b: {}}\n");
  EXPECT_NE(apart.FirstOf(7).seed, apart.FirstOf(41 + 7).seed);
}

TEST(Ranges, StandInTheResolvedPlan) {
  const Plan plan = Make(kMilk + kFind);
  const Plan again(plan.resolved(), "plan.yaml");
  EXPECT_EQ(again.resolved(), plan.resolved());
  EXPECT_EQ(again.Trial(50).parameters, plan.Trial(50).parameters);
  const TrialRule rule = RuleOf(HeaderOf(plan, {}));
  ASSERT_TRUE(rule.search);
  EXPECT_EQ(rule.cells, 41);
  EXPECT_EQ(rule.search->rate, 0.8);
  EXPECT_EQ(rule.search->lattice.axes[0].trend, search::Trend::kFalls);
}

// A shard decides about whole boundaries.
TEST(Ranges, AreWholeInAShard) {
  const Plan plan = Make(kMilk + kFind + "cases: {a: {}, b: {}}\n");
  const TrialRule rule = RuleOf(HeaderOf(plan, {}));
  for (const int64_t cell : {0, 20, 40}) {
    EXPECT_TRUE(IsOf({1, 2}, rule, plan.NumberOf(cell, 3)));
    EXPECT_FALSE(IsOf({1, 2}, rule, plan.NumberOf(cell + 41, 3)));
  }
}

TEST(Ranges, OfBadInputSaysWhereAndWhatIsAllowed) {
  const auto range = [](const std::string& of) {
    return "ranges: {water.milk_ml_m3: {" + of + "}}\n" + kFind;
  };
  EXPECT_EQ(ErrorOf(range("from: 3, to: 3")),
            "plan.yaml:3: ranges.water.milk_ml_m3.to: must differ from `from`");
  EXPECT_THAT(ErrorOf(range("from: 1, to: 1.00001")), HasSubstr("so near to `from`"));
  EXPECT_THAT(ErrorOf(range("from: -1, to: 3")), HasSubstr("plan.yaml:3: "));
  EXPECT_THAT(ErrorOf(range("from: -1, to: 3")), HasSubstr("water.milk_ml_m3 = -1, must be"));
  EXPECT_THAT(ErrorOf(range("from: 1")), HasSubstr("must have the keys `from` and `to`"));
  EXPECT_THAT(ErrorOf(range("from: 0, to: 3, scale: logarithmic")), HasSubstr("must be > 0"));
  EXPECT_THAT(ErrorOf(range("from: 0, to: 3, success: drops")), HasSubstr("falls, rises"));
  EXPECT_THAT(ErrorOf(range("from: 0, to: 3, step: 1")), HasSubstr("unknown key"));
  EXPECT_THAT(ErrorOf("ranges: {sea.state: {from: 0, to: 3}}\n" + kFind),
              HasSubstr("must be one of custom, calm"));
  EXPECT_THAT(ErrorOf("ranges: {scenario: {from: 0, to: 3}}\n" + kFind), HasSubstr("is no number"));
  EXPECT_THAT(ErrorOf("ranges: {description: {from: 0, to: 3}}\n" + kFind),
              HasSubstr("is no number"));
  EXPECT_THAT(ErrorOf("ranges: {}\n" + kFind), HasSubstr("one to three keys"));
  EXPECT_THAT(
      ErrorOf("ranges: {a: {from: 0, to: 1}, b: {from: 0, to: 1}, c: {from: 0, to: 1}, d: {from: "
              "0, to: 1}}\n" +
              kFind),
      HasSubstr("one to three keys"));
  EXPECT_THAT(ErrorOf(kMilk), HasSubstr("plan.yaml:3: ranges: go with `find`"));
  const Plan plan = Make(kMilk + "find: {}\n");
  EXPECT_EQ(Plan(plan.resolved(), "resolved").resolved(), plan.resolved());
  EXPECT_THAT(ErrorOf(kFind), HasSubstr("plan.yaml:3: find: goes with `ranges`"));
  for (const char* rate : {"0", "1"})
    EXPECT_THAT(ErrorOf(kMilk + fmt::format("find: {{rate: {}}}\n", rate)),
                HasSubstr(fmt::format("plan.yaml:4: find.rate = {}, must be in", rate)));
  EXPECT_THAT(ErrorOf(kMilk + kFind + "precision: 0.1\n"), HasSubstr("does not go with `ranges`"));
  EXPECT_THAT(ErrorOf(kMilk + kFind + "seeds: 5\n"), HasSubstr("plan.yaml:5: seeds: does not go"));
  EXPECT_THAT(ErrorOf(kMilk + kFind + "strata: {a: {}}\n"), HasSubstr("does not go with `ranges`"));
  EXPECT_THAT(ErrorOf(kMilk + kFind + "grid: {water.milk_ml_m3: [1, 2]}\n"),
              HasSubstr("given twice"));
  const std::string current =
      "ranges: {\"sea.current.surface_velocity_mps[1]\": {from: 0, to: 1}}\n" + kFind;
  const std::string whole = "sea.current.surface_velocity_mps: [0.1, 0.2, 0]";
  EXPECT_EQ(ErrorOf(current + "set: {\"sea.current.surface_velocity_mps[0]\": 0.1}\n"), "no error");
  for (const std::string& by : {"set: {" + whole + "}", "cases: {a: {}, b: {" + whole + "}}"})
    EXPECT_EQ(ErrorOf(current + by + "\n"), "no error");
  EXPECT_THAT(
      ErrorOf(current + "grid: {sea.current.surface_velocity_mps: [[0, 0, 0], [1, 0, 0]]}\n"),
      HasSubstr("twice, also in the list of plan.yaml:5"));
  EXPECT_EQ(ErrorOf("set: {sea.waves: [{period_s: 3}]}\n"
                    "ranges: {sea.waves.0.height_m: {from: 0, to: 1}}\n" +
                    kFind),
            "no error")
      << "of a list that is empty by default";
  EXPECT_THAT(ErrorOf("ranges: {cameras.delay_frames: {from: 0, to: 30}}\n" + kFind),
              HasSubstr("is a whole number, and a range has values between"));
  EXPECT_THAT(ErrorOf("ranges: {sea.current.gust_std_mps: {from: 0, to: 50}}\n" + kFind),
              HasSubstr("= 50, must be in [0, 2]"))
      << "a value that the file has";
  EXPECT_THAT(ErrorOf(kMilk + kFind, {.seeds = 3}), HasSubstr("--seeds: does not go with"));
  EXPECT_THAT(ErrorOf(kMilk + kFind, {.refused = {kNoRanges}}),
              HasSubstr("only `turbidock batch` looks for a boundary"));
}

}  // namespace
}  // namespace turbidock::batch
