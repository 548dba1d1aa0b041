// What a batch with ranges says: where success crosses a rate, and where that answer does not hold.

#include "experiments/batch/envelope.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "experiments/batch/batch.h"
#include "experiments/report/report.h"
#include "sim/base/random.h"
#include "tests/support/stored_trials.h"

namespace turbidock::batch {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

double Logistic(double x) { return 1 / (1 + std::exp(-x)); }

// A batch over milk from 0 to 80 ml/m3 and its trials, which end by lot at rates that go with the
// place in [0, 1] on the range, and in a failure of this kind.
struct Batch {
  explicit Batch(const std::function<double(double)>& rate, const std::string& success = "falls",
                 trial::Outcome fails = trial::Outcome::kCollision) {
    header.plan = fmt::format(
        "ranges: {{water.milk_ml_m3: {{from: 0, to: 80, success: {}}}}}\nfind: {{trials: 1000}}\n",
        success);
    header.trials = 41 * kMostOfCell;
    header.keys = {"water.milk_ml_m3"};
    TrialScheduler scheduler(RuleOf(header), {});
    Rng rng = SeedTree(1).Stream("outcomes");
    while (const auto number = scheduler.Next()) {
      const int64_t cell = *number % 41;
      const bool docks = rng.Uniform() < rate(static_cast<double>(cell) / 40);
      StoredTrial trial{.trial = *number, .cell = cell, .sample = *number / 41, .parameters = {}};
      trial.parameters = {{"water.milk_ml_m3", fmt::format("{}", 2 * cell)}};
      testing::End(&trial.record, docks ? trial::Failure::kNone : trial::Failure::kCollision);
      if (!docks) trial.record.outcome = fails;
      trials.push_back(trial);
      scheduler.Add(*number, docks);
    }
  }
  EnvelopeSummary Summary() const { return *EnvelopesOf(header, trials); }

  StoreHeader header;
  std::vector<StoredTrial> trials;
};

TEST(Envelope, SaysWhereSuccessCrossesTheRate) {
  // 0.9 at 40 ml/m3
  const Batch batch([](double x) { return Logistic(2.197 - 30 * (x - 0.5)); });
  const EnvelopeSummary summary = batch.Summary();
  ASSERT_THAT(summary.envelopes, SizeIs(1));
  const Envelope& envelope = summary.envelopes[0];
  EXPECT_TRUE(envelope.reached);
  EXPECT_THAT(envelope.limits, IsEmpty());
  ASSERT_THAT(envelope.crossings, SizeIs(1));
  const Crossing& crossing = envelope.crossings[0];
  EXPECT_NEAR(crossing.value, 40, 5);
  EXPECT_LT(crossing.low, 40);
  EXPECT_GT(crossing.high, 40);
  EXPECT_LT(crossing.high - crossing.low, 12);
  EXPECT_THAT(CrossingText(summary, crossing), StartsWith("90 % up to water milk "));
  const report::Json json = EnvelopeJson(summary)["envelopes"][0];
  EXPECT_EQ(json["crossings"][0]["value"], crossing.value);
  EXPECT_EQ(json["sides"][0], 1);
  EXPECT_EQ(json["sides"][40], -1);
}

// Each point of the picture opens its trial.
TEST(Envelope, ShowsEveryTrialAsAPoint) {
  const Batch batch([](double x) { return Logistic(2.197 - 30 * (x - 0.5)); });
  const report::Section section = EnvelopeSection(batch.Summary());
  ASSERT_THAT(section.panels, SizeIs(1));
  std::vector<std::string> links;
  for (const report::Series& series : section.panels[0].series) {
    if (series.links.empty()) continue;
    ASSERT_EQ(series.links.size(), series.points.size());
    links.insert(links.end(), series.links.begin(), series.links.end());
  }
  EXPECT_EQ(links.size(), batch.trials.size());
  for (const StoredTrial& trial : batch.trials)
    EXPECT_THAT(links, Contains(TrialLink(trial.trial)));
  // the undecided cells, about 40
  ASSERT_FALSE(section.panels[0].blocks.empty());
  EXPECT_GT(section.panels[0].blocks.front().from_x, 28);
  EXPECT_LT(section.panels[0].blocks.back().to_x, 52);
}

TEST(Envelope, SaysWhereTheAnswerDoesNotHold) {
  const auto limits = [](const Batch& batch) { return batch.Summary().envelopes[0].limits; };
  const Batch all([](double) { return 1; });
  EXPECT_THAT(limits(all), Contains(HasSubstr("shown to be below 90 %: the boundary may be out")));
  EXPECT_THAT(CrossingText(all.Summary(), all.Summary().envelopes[0].crossings[0]),
              StartsWith("90 % up to water milk beyond 80 ["));
  const Batch none([](double) { return 0; });
  EXPECT_THAT(limits(none), Contains(HasSubstr("shown to be above 90 %: the boundary may be out")));
  const Batch crashed([](double) { return 0; }, "falls", trial::Outcome::kCrashed);
  EXPECT_THAT(limits(crashed), Contains(HasSubstr("Every trial crashed or hung")));
  EXPECT_THAT(limits(none), ::testing::Not(Contains(HasSubstr("crashed"))));
}

TEST(Envelope, SaysThatSuccessIsNotMonotone) {
  const auto hole = [](double x) { return x < 0.2 || x > 0.55 ? 1 : 0; };
  EXPECT_THAT(Batch(hole, "falls").Summary().envelopes[0].limits,
              Contains(HasSubstr("not monotone in water milk, although the plan says so")));
  EXPECT_THAT(Batch(hole, "unknown").Summary().envelopes[0].limits,
              Contains(HasSubstr("above 90 % in 2 separate regions")));
}

}  // namespace
}  // namespace turbidock::batch
