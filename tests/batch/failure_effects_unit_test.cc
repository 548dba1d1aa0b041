// What goes with failures: odds against numbers worked out another way, and what is left out.

#include "experiments/batch/failure_effects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "experiments/report/table.h"
#include "sim/base/random.h"
#include "tests/support/stored_trials.h"

namespace turbidock::batch {
namespace {

using ::testing::HasSubstr;

StoredTrial Trial(int64_t seed, bool failed, const std::vector<Parameter>& parameters) {
  StoredTrial trial{.trial = seed, .parameters = parameters};
  trial.record.seed = seed;
  testing::End(&trial.record, failed ? trial::Failure::kTimeout : trial::Failure::kNone);
  return trial;
}

// 40 trials: those that start far to a side fail, depth has nothing to do with it.
std::vector<StoredTrial> FarOnesFail() {
  std::vector<StoredTrial> trials;
  for (int i = 0; i < 40; ++i) {
    trials.push_back(Trial(
        i, i >= 30,
        {{"sea.depth_m", FormatNumber(i * 7 % 40)}, {"start.lateral_m", FormatNumber(0.01 * i)}}));
    trials.back().record.start.y_m = (i % 2 == 0 ? 0.01 : -0.01) * i;
  }
  return trials;
}

TEST(FailureEffects, PutsWhatFailuresHangOnFirst) {
  const std::vector<FailureEffect> effects = FailureEffects(FarOnesFail());
  ASSERT_EQ(effects.size(), 3u);
  EXPECT_EQ(effects[0].name, "start lateral");
  EXPECT_EQ(effects[0].change, "97.5 to 292.5 mm");
  EXPECT_TRUE(effects[0].significant);
  EXPECT_GT(effects[0].odds_low, 1);
  EXPECT_EQ(effects[1].name, "|start y|") << "to either side";
  EXPECT_NEAR(effects[1].odds, effects[0].odds, 1e-6 * effects[0].odds);
  EXPECT_EQ(effects[2].name, "sea depth");
  EXPECT_FALSE(effects[2].significant);
  const std::string table = FailureSection(effects)->table->Text();
  EXPECT_THAT(table, HasSubstr("start lateral  97.5 to 292.5 mm"));
}

// 8 of 10 and 8 of 30 fail; with half a trial more of each, odds of 8.5/2.5 and 8.5/22.5.
TEST(FailureEffects, ComparesAValueWithTheOthers) {
  std::vector<StoredTrial> trials;
  for (int i = 0; i < 40; ++i) {
    const char* name = i < 10 ? "weak" : i < 25 ? "planned" : "late";
    trials.push_back(
        Trial(i, i < 8 || (i >= 10 && i < 13) || (i >= 25 && i < 30), {{"case", name}}));
  }
  const std::vector<FailureEffect> effects = FailureEffects(trials);
  ASSERT_EQ(effects.size(), 3u);
  EXPECT_EQ(effects[0].name, "case: weak");
  EXPECT_EQ(effects[0].change, "against the others");
  EXPECT_NEAR(effects[0].odds, (8.5 / 2.5) / (8.5 / 22.5), 1e-6);
  EXPECT_TRUE(effects[0].significant);
  EXPECT_EQ(effects[1].name, "case: planned") << "3 of 15 failed";
  EXPECT_LT(effects[1].odds, 1);

  for (StoredTrial& trial : trials)
    if (trial.parameters[0].value == "late") trial.parameters[0].value = "planned";
  EXPECT_EQ(FailureEffects(trials).size(), 1u) << "of two values the other says the same";
  trials[0].parameters[0].value = "once";
  for (const FailureEffect& effect : FailureEffects(trials))
    EXPECT_NE(effect.name, "case: once") << "too few have it";
}

TEST(FailureEffects, OfNumbersOfWhichMostAreOneTakesTheWholeRange) {
  std::vector<StoredTrial> trials;
  for (int i = 0; i < 40; ++i)
    trials.push_back(Trial(i, i < 12, {{"cameras.delay_frames", i < 9 ? "4" : "1"}}));
  const std::vector<FailureEffect> effects = FailureEffects(trials);
  ASSERT_EQ(effects.size(), 1u);
  EXPECT_EQ(effects[0].change, "1 to 4");
  EXPECT_NEAR(effects[0].odds, (9.5 / 0.5) / (3.5 / 28.5), 1e-5);
}

TEST(FailureEffects, SaysNothingOfTooFewFailuresOrASingleSeed) {
  std::vector<StoredTrial> trials = FarOnesFail();
  for (int i = 30; i < 36; ++i) trials[i] = Trial(i, false, trials[i].parameters);
  EXPECT_TRUE(FailureEffects(trials).empty()) << "4 failures";
  EXPECT_TRUE(FailureEffects({}).empty());
  EXPECT_FALSE(FailureSection({}));
  trials = FarOnesFail();
  for (StoredTrial& trial : trials) trial.record.seed = 1;
  EXPECT_TRUE(FailureEffects(trials).empty());
}

// Six drawn parameters that do nothing, in 8 cells of 25 seeds which decide much by themselves: at
// most one run in twenty calls any significant.
TEST(FailureEffects, SeldomBlamesWhatDoesNothing) {
  Rng rng(3, 0);
  int alarms = 0;
  constexpr int kRuns = 60;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<StoredTrial> trials;
    for (int seed = 0; seed < 25; ++seed) {
      std::vector<Parameter> drawn;
      for (const char* key : {"a", "b", "c", "d", "e", "f"})
        drawn.push_back({key, FormatNumber(rng.Normal())});
      const double log_odds = -1 + 2 * rng.Normal();
      for (int cell = 0; cell < 8; ++cell)
        trials.push_back(Trial(seed, rng.Uniform() < 1 / (1 + std::exp(-log_odds)), drawn));
    }
    const std::vector<FailureEffect> effects = FailureEffects(trials);
    if (effects.empty()) continue;
    alarms += effects.front().significant;
    if (!effects.front().significant) {
      EXPECT_THAT(FailureSection(effects)->lines[0], HasSubstr("No starting condition"));
    }
  }
  EXPECT_LE(alarms, 6);
  RecordProperty("alarms", alarms);
}

}  // namespace
}  // namespace turbidock::batch
