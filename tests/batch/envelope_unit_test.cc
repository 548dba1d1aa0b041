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

using Rate = std::function<double(double)>;  // at a place in [0, 1] on the range

// A batch over milk from 0 to 80 ml/m3 and its trials, which end by lot at these rates, and in a
// failure of this kind. Several rates: a case each, whose trials of a place and sample have the
// seed and the lot in common.
struct Batch {
  explicit Batch(const std::vector<Rate>& rates, const std::string& success = "falls",
                 trial::Outcome fails = trial::Outcome::kCollision) {
    header.plan = fmt::format(
        "ranges: {{water.milk_ml_m3: {{from: 0, to: 80, success: {}}}}}\nfind: {{trials: 1000}}\n",
        success);
    if (rates.size() > 1) header.plan += "cases: {first: {}, second: {}}\n";
    const int64_t cells = 41 * std::ssize(rates);
    header.trials = cells * kMostOfCell;
    header.keys = {"water.milk_ml_m3"};
    if (rates.size() > 1) header.keys.insert(header.keys.begin(), "case");
    TrialScheduler scheduler(RuleOf(header), {});
    while (const auto number = scheduler.Next()) {
      const int64_t cell = *number % cells, place = cell % 41, sample = *number / cells;
      const int64_t seed = SeedTree(static_cast<uint64_t>(place)).TrialSeed(sample);
      const double lot = SeedTree(static_cast<uint64_t>(seed)).Stream("outcome").Uniform();
      const bool docks =
          lot < rates[static_cast<size_t>(cell / 41)](static_cast<double>(place) / 40);
      StoredTrial trial{.trial = *number, .cell = cell, .sample = sample, .parameters = {}};
      if (rates.size() > 1) trial.parameters = {{"case", cell < 41 ? "first" : "second"}};
      trial.parameters.push_back({"water.milk_ml_m3", fmt::format("{}", 2 * place)});
      trial.record.seed = seed;
      testing::End(&trial.record, docks ? trial::Failure::kNone : trial::Failure::kCollision);
      if (!docks) trial.record.outcome = fails;
      trials.push_back(trial);
      scheduler.Add(*number, docks);
    }
  }
  explicit Batch(const Rate& rate, const std::string& success = "falls",
                 trial::Outcome fails = trial::Outcome::kCollision)
      : Batch(std::vector{rate}, success, fails) {}
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

TEST(Envelope, SaysByHowMuchTwoCasesDiffer) {
  const auto at = [](double boundary) -> Rate {
    return [boundary](double x) { return Logistic(2.197 - 30 * (x - boundary)); };
  };
  Batch batch({at(0.6), at(0.4)});
  EXPECT_THAT(Batch(at(0.5)).Summary().differences, IsEmpty());
  const EnvelopeSummary summary = batch.Summary();
  ASSERT_THAT(summary.differences, SizeIs(1));
  const EnvelopeDifference& difference = summary.differences[0];
  ASSERT_THAT(difference.crossings, SizeIs(1));
  const search::Difference& crossing = difference.crossings[0].second;
  EXPECT_NEAR(crossing.value, -16, 6);
  EXPECT_LT(crossing.low, -16);
  EXPECT_GT(crossing.high, -16);
  EXPECT_NEAR(difference.area.value, -0.2, 0.07);
  EXPECT_NEAR(summary.envelopes[0].area.value, 0.6, 0.06);
  const report::Json json = EnvelopeJson(summary)["differences"][0];
  EXPECT_EQ(json["of"], "second");
  EXPECT_EQ(json["less"], "first");
  EXPECT_EQ(json["crossings"][0]["low"], crossing.low);
  EXPECT_EQ(json["area"]["value"], difference.area.value);
  EXPECT_THAT(
      EnvelopeSection(summary).lines,
      Contains(StartsWith("second less first: the 90 % boundary in water milk is moved by -")));
  // trials of the same seed and no others are pairs
  EXPECT_GT(difference.pairs, 20);
  for (StoredTrial& trial : batch.trials) trial.record.seed += trial.cell / 41;
  EXPECT_EQ(batch.Summary().differences[0].pairs, 0);
  for (StoredTrial& trial : batch.trials)
    if (trial.cell / 41 == 1) trial.record.outcome = trial::Outcome::kCrashed;
  EXPECT_THAT(batch.Summary().differences, IsEmpty()) << "of nothing";
}

TEST(Envelope, GivesTheLowerEndOfAnIntervalFirstWhereARangeRunsDown) {
  Batch batch([](double x) { return Logistic(2.197 - 30 * (x - 0.5)); });
  const std::string up = "from: 0, to: 80";
  batch.header.plan.replace(batch.header.plan.find(up), up.size(), "from: 80, to: 0");
  const Crossing crossing = batch.Summary().envelopes[0].crossings[0];
  EXPECT_LT(crossing.low, crossing.value);
  EXPECT_GT(crossing.high, crossing.value);
}

// Docks between 24 and 56 ml/m3.
TEST(Envelope, SaysBothEndsOfAnIsland) {
  const Batch batch([](double x) { return std::abs(x - 0.5) < 0.2 ? 1 : 0; }, "unknown");
  const EnvelopeSummary summary = batch.Summary();
  const std::vector<Crossing>& crossings = summary.envelopes[0].crossings;
  ASSERT_THAT(crossings, SizeIs(2));
  EXPECT_NEAR(crossings[0].value, 24, 5);
  EXPECT_NEAR(crossings[1].value, 56, 5);
  EXPECT_THAT(CrossingText(summary, crossings[0]), StartsWith("90 % from water milk 2"));
  EXPECT_THAT(CrossingText(summary, crossings[1]), StartsWith("90 % up to water milk 5"));
  EXPECT_EQ(crossings[0].to, crossings[1].from);
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
  const report::Json beyond = EnvelopeJson(all.Summary())["envelopes"][0]["crossings"][0];
  EXPECT_GT(beyond["beyond"], 0.5);
  EXPECT_LT(beyond["before"], 0.025);  // outside of the 95 %
  const Batch none([](double) { return 0; });
  EXPECT_THAT(limits(none), Contains(HasSubstr("shown to be above 90 %: the boundary may be out")));
  const Batch crashed([](double) { return 0; }, "falls", trial::Outcome::kCrashed);
  EXPECT_THAT(limits(crashed), ::testing::ElementsAre(HasSubstr("Every trial crashed or hung")));
  EXPECT_THAT(crashed.Summary().envelopes[0].crossings, ::testing::IsEmpty());
  const report::Json nothing = EnvelopeJson(crashed.Summary())["envelopes"][0];
  EXPECT_EQ(nothing["sides"], report::Json(std::vector<int>(41, 0)));
  EXPECT_TRUE(nothing["area"].is_null());
  EXPECT_THAT(limits(none), ::testing::Not(Contains(HasSubstr("crashed"))));
}

TEST(Envelope, SaysThatSuccessDoesTheOpposite) {
  for (const char* said : {"rises", "falls"}) {
    const bool falls = said == std::string("rises");
    const Batch batch([falls](double x) { return (x < 0.4) == falls ? 1 : 0; }, said);
    EXPECT_THAT(batch.Summary().envelopes[0].limits, Contains(HasSubstr("is not monotone")))
        << said << ", after " << batch.trials.size();
  }
}

TEST(Envelope, SaysThatSuccessIsNotMonotone) {
  const Rate hole = [](double x) { return x < 0.2 || x > 0.55 ? 1 : 0; };
  EXPECT_THAT(Batch(hole, "falls").Summary().envelopes[0].limits,
              Contains(HasSubstr("not monotone in water milk, although the plan says so")));
  EXPECT_THAT(Batch(hole, "unknown").Summary().envelopes[0].limits,
              Contains(HasSubstr("above 90 % in 2 separate regions")));
}

// The limits of an envelope of two ranges, searched by lot at these rates at places in [0, 1].
std::vector<std::string> LimitsInTwo(uint64_t seed,
                                     const std::function<double(double x, double y)>& rate) {
  const EnvelopePlan plan{
      .ranges = {{.key = "water.milk_ml_m3", .from = 0, .to = 80, .success = search::Trend::kFalls},
                 {.key = "water.contrast", .from = 0, .to = 1, .success = search::Trend::kFalls}}};
  const search::BoundarySearch search = plan.Search();
  std::vector<search::Tally> tallies(441);
  std::vector<int64_t> run(441);
  std::vector<StoredTrial> trials;
  Rng rng = SeedTree(seed).Stream("lots");
  for (;;) {
    const std::vector<int> cells = NextRound(search, tallies, run);
    if (cells.empty()) break;
    for (const int cell : cells) {
      const auto c = static_cast<size_t>(cell);
      const bool docks = rng.Uniform() < rate((cell / 21) / 20.0, (cell % 21) / 20.0);
      ++run[c], ++tallies[c].trials, tallies[c].successes += docks;
      StoredTrial& trial = trials.emplace_back();
      trial.cell = cell;
      testing::End(&trial.record, docks ? trial::Failure::kNone : trial::Failure::kCollision);
    }
  }
  std::vector<const StoredTrial*> all;
  for (const StoredTrial& trial : trials) all.push_back(&trial);
  return EnvelopeOf(plan, "", all).limits;
}

// By single cells this seed's step seemed not to be monotone.
TEST(Envelope, SaysSoInTwoRangesOfAHoleAndNotOfAStep) {
  constexpr uint64_t kSeed = 1;
  EXPECT_THAT(LimitsInTwo(kSeed,
                          [](double x, double y) {
                            const bool is_hole = std::hypot(x - 0.3, y - 0.3) < 0.15;
                            return is_hole ? 0.2 : Logistic(3.5 - 10 * (x + y - 1.5));
                          }),
              Contains(HasSubstr("not monotone in water milk, water contrast")));
  EXPECT_THAT(
      LimitsInTwo(kSeed, [](double x, double y) { return std::hypot(x, y) < 0.7 ? 0.97 : 0.3; }),
      ::testing::Not(Contains(HasSubstr("not monotone"))));
}

}  // namespace
}  // namespace turbidock::batch
