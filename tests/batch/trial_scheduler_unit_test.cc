// Which trials a batch runs: with a precision, as many as each cell needs, and the same however
// they are run.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "experiments/batch/batch.h"
#include "experiments/statistics/intervals.h"
#include "sim/base/random.h"

namespace turbidock::batch {
namespace {

using ::testing::ElementsAre;

// What came of a trial, by cell and sample.
using Outcome = std::function<bool(int64_t cell, int64_t sample)>;

// Runs until nothing is left to do or `trials` have ended, `workers` at a time, which end in random
// order; what is under way then is lost.
void RunTrials(TrialScheduler scheduler, const TrialRule& rule, const Outcome& outcome,
               size_t workers, Rng* rng, std::map<int64_t, bool>* results,
               int64_t trials = 1'000'000) {
  std::vector<int64_t> under_way;
  for (; trials > 0; --trials) {
    while (under_way.size() < workers) {
      const std::optional<int64_t> next = scheduler.Next();
      if (!next) break;
      under_way.push_back(*next);
    }
    if (under_way.empty()) {
      EXPECT_TRUE(scheduler.complete());
      return;
    }
    const auto at =
        under_way.begin() +
        static_cast<std::ptrdiff_t>(rng->Uniform(0, 1) * static_cast<double>(under_way.size()));
    const int64_t trial = *at;
    under_way.erase(at);
    const bool success = outcome(trial % rule.cells, trial / rule.cells);
    EXPECT_TRUE(results->emplace(trial, success).second) << trial;
    scheduler.Add(trial, success);
    EXPECT_LE(scheduler.wanted(), scheduler.most());
    EXPECT_LE(scheduler.successes(), scheduler.done());
  }
}

// The trials of the cells when one worker runs them all.
std::vector<int64_t> TrialsByCell(const TrialRule& rule, const std::map<int64_t, bool>& results) {
  std::vector<int64_t> trials(static_cast<size_t>(rule.cells));
  for (const auto& [trial, success] : results) ++trials[static_cast<size_t>(trial % rule.cells)];
  return trials;
}

TEST(TrialScheduler, WithoutAPrecisionHasEveryTrialOfTheShardInOrder) {
  const TrialRule rule{.batch = 7, .most = 7, .precision = {}};
  TrialScheduler scheduler(rule, {2, 3});
  scheduler.Add(4, true);
  EXPECT_EQ(scheduler.wanted(), 2);  // 1 and 4
  EXPECT_EQ(scheduler.most(), 2);
  EXPECT_EQ(scheduler.done(), 1);
  EXPECT_EQ(scheduler.successes(), 1);
  EXPECT_EQ(scheduler.Next(), 1);
  EXPECT_EQ(scheduler.Next(), std::nullopt);
  EXPECT_FALSE(scheduler.complete());
  scheduler.Add(1, false);
  EXPECT_TRUE(scheduler.complete());
}

TEST(TrialScheduler, CountsNoTrialThatSaysNothingOfSuccess) {
  TrialScheduler scheduler({.cells = 1, .batch = 20, .most = 45, .precision = 0.1}, {});
  // Of twenty five are silent: fifteen successes are too few (the test below).
  while (const auto trial = scheduler.Next())
    scheduler.Add(*trial, *trial % 4 == 0 ? std::nullopt : std::optional(true));
  EXPECT_EQ(scheduler.done(), 40);
  EXPECT_EQ(scheduler.successes(), 30);
  EXPECT_EQ(scheduler.reached(), 1);
  EXPECT_TRUE(scheduler.complete());
}

TEST(TrialScheduler, LooksAtACellOnlyWhenABatchOfItIsWhole) {
  const TrialRule rule{.cells = 1, .batch = 10, .most = 45, .precision = 0.1};
  // All succeed: the interval is narrow enough after 16 trials, which is seen after 20.
  EXPECT_GT(statistics::WilsonInterval(15, 15).half_width(), 0.1);
  EXPECT_LE(statistics::WilsonInterval(16, 16).half_width(), 0.1);
  TrialScheduler scheduler(rule, {});
  std::vector<int64_t> handed_out;
  while (const auto trial = scheduler.Next()) handed_out.push_back(*trial);
  EXPECT_EQ(handed_out.size(), 10u);
  for (int64_t trial = 9; trial > 0; --trial) scheduler.Add(trial, true);
  EXPECT_EQ(scheduler.Next(), std::nullopt);  // the first one is missing
  EXPECT_EQ(scheduler.wanted(), 10);
  scheduler.Add(0, true);
  EXPECT_EQ(scheduler.wanted(), 20);
  for (int64_t trial = 10; trial < 20; ++trial) {
    EXPECT_EQ(scheduler.Next(), trial);
    EXPECT_FALSE(scheduler.complete());
    scheduler.Add(trial, true);
  }
  EXPECT_TRUE(scheduler.complete());
  EXPECT_EQ(scheduler.Next(), std::nullopt);
  EXPECT_EQ(scheduler.reached(), 1);
  EXPECT_EQ(scheduler.wanted(), 20);
  EXPECT_EQ(scheduler.most(), 45);
}

TEST(TrialScheduler, StopsACellAtItsMostTrials) {
  const TrialRule rule{.cells = 2, .batch = 10, .most = 45, .precision = 0.1};
  Rng rng = SeedTree(1).Stream("scheduler");
  std::map<int64_t, bool> results;
  RunTrials(
      TrialScheduler(rule, {}), rule,
      [](int64_t cell, int64_t sample) { return cell == 1 && sample % 2; }, 1, &rng, &results);
  EXPECT_THAT(TrialsByCell(rule, results), ElementsAre(20, 45));
  TrialScheduler scheduler(rule, {});
  for (const auto& [trial, success] : results) scheduler.Add(trial, success);
  EXPECT_EQ(scheduler.cells(), 2);
  EXPECT_EQ(scheduler.reached(), 1);
}

// Interrupted: after every so many trials.
void ExpectTheSameTrialsHoweverTheyAreRun(const TrialRule& rule, int64_t interrupted_after = 13) {
  const Outcome outcome = [](int64_t cell, int64_t sample) {
    const std::string name = std::to_string(cell) + ":" + std::to_string(sample);
    return SeedTree(5).Stream(name).Uniform(0, 1) < static_cast<double>(cell) / 6;
  };
  Rng rng = SeedTree(2).Stream("scheduler");
  std::map<int64_t, bool> alone;
  RunTrials(TrialScheduler(rule, {}), rule, outcome, 1, &rng, &alone);
  const std::vector<int64_t> trials = TrialsByCell(rule, alone);
  EXPECT_GE(std::set(trials.begin(), trials.end()).size(), 5u) << "cells of different sizes";
  int compared = 0;
  for (const size_t workers : {1, 2, 3, 16})
    for (const int shards : {1, 2, 3, 7})
      for (const bool interrupted : {false, true}) {
        std::map<int64_t, bool> all;
        for (int index = 1; index <= shards; ++index) {
          std::map<int64_t, bool> results;
          const auto resumed = [&] {
            TrialScheduler scheduler(rule, {index, shards});
            std::vector<std::pair<int64_t, bool>> known(results.begin(), results.end());
            if (rng.Uniform(0, 1) < 0.5) std::reverse(known.begin(), known.end());
            for (const auto& [trial, success] : known) scheduler.Add(trial, success);
            return scheduler;
          };
          while (interrupted && !resumed().complete())
            RunTrials(resumed(), rule, outcome, workers, &rng, &results, interrupted_after);
          RunTrials(resumed(), rule, outcome, workers, &rng, &results);
          for (const auto& [trial, success] : results)
            EXPECT_TRUE(all.emplace(trial, success).second) << "two shards have trial " << trial;
        }
        EXPECT_EQ(all, alone) << workers << " workers, " << shards << " shards";
        ++compared;
      }
  EXPECT_EQ(compared, 32);
}

TEST(TrialScheduler, HasTheSameTrialsForAnyWorkersShardsAndInterruptions) {
  ExpectTheSameTrialsHoweverTheyAreRun({.cells = 5, .batch = 12, .most = 130, .precision = 0.09});
  ExpectTheSameTrialsHoweverTheyAreRun(
      {.cells = 5, .batch = 12, .most = 132, .precision = 0.09, .strata = 3});
}

TEST(TrialScheduler, AShardHasAsManyTrialsOfEveryStratum) {
  const TrialRule rule{.batch = 18, .most = 18, .precision = {}, .strata = 3};
  std::set<int64_t> all;
  for (const int index : {1, 2, 3}) {
    TrialScheduler scheduler(rule, {index, 3});
    std::array<int, 3> of_stratum{};
    while (const auto trial = scheduler.Next()) {
      EXPECT_TRUE(all.insert(*trial).second);
      ++of_stratum[static_cast<size_t>(*trial % 3)];
    }
    EXPECT_THAT(of_stratum, ElementsAre(2, 2, 2));
  }
  EXPECT_EQ(all.size(), 18u);
}

// Of 2,000 cells with a precision of 0.03 in which a trial of the stratum succeeds at such a rate:
// the share whose interval holds the true rate, and means of the rates found and of trials. A share
// of 0.95 is then known to 0.005 (one standard deviation).
struct Coverage {
  double holds = 0, rate = 0, trials = 0;
};
Coverage CoverageOf(const std::string& name, int strata, double true_rate,
                    const std::function<double(double)>& rate_at) {
  constexpr int kCells = 2000;
  const TrialRule rule{
      .cells = kCells, .batch = 30, .most = 1080, .precision = 0.03, .strata = strata};
  Rng rng = SeedTree(3).Stream(name);
  TrialScheduler scheduler(rule, {});
  std::vector<std::vector<statistics::Count>> counts(
      kCells, std::vector<statistics::Count>(static_cast<size_t>(strata)));
  while (const auto trial = scheduler.Next()) {
    const auto stratum = static_cast<size_t>(*trial / rule.cells % strata);
    const double x = (static_cast<double>(stratum) + rng.Uniform(0, 1)) / strata;
    const bool success = rng.Uniform(0, 1) < rate_at(x);
    statistics::Count& count = counts[static_cast<size_t>(*trial % rule.cells)][stratum];
    ++count.trials;
    count.successes += success;
    scheduler.Add(*trial, success);
  }
  EXPECT_EQ(scheduler.reached(), kCells) << name;
  Coverage found;
  for (const auto& cell : counts) {
    const statistics::Interval interval = statistics::StratifiedInterval(cell);
    EXPECT_LE(interval.half_width(), 0.03);
    found.holds += (interval.low <= true_rate && true_rate <= interval.high) / (1.0 * kCells);
    double all = 0, successes = 0;
    for (const statistics::Count& count : cell) {
      EXPECT_EQ(count.trials, cell[0].trials);
      all += static_cast<double>(count.trials);
      successes += static_cast<double>(count.successes);
    }
    found.trials += all / kCells;
    found.rate += successes / all / kCells;
  }
  EXPECT_GE(found.holds, 0.93) << name;
  EXPECT_NEAR(found.rate, true_rate, 0.005) << name;
  ::testing::Test::RecordProperty("coverage_" + name, std::to_string(found.holds));
  ::testing::Test::RecordProperty("trials_" + name, std::to_string(found.trials));
  return found;
}

// A rule that looks at what it counts is biased; how much is measured here.
TEST(TrialScheduler, ItsIntervalsHoldTheTrueRateAboutAsOftenAsTheySay) {
  for (const double rate : {0.02, 0.05, 0.08, 0.2, 0.5, 0.7, 0.9, 0.97})
    CoverageOf(fmt::format("{}", rate), /*strata=*/1, rate, [rate](double) { return rate; });
}

// The same where success falls with something that the plan's strata cut in six: steeply, gently or
// not at all.
TEST(TrialScheduler, ItsIntervalsOverStrataHoldTheTrueRateWithFewerTrials) {
  constexpr double kFlat = 1e6;  // a width: `middle` is then the rate everywhere
  for (const double width : {0.01, 0.03, 0.1, 0.3, kFlat})
    for (const double middle : {0.1, 0.25, 0.4, 0.5, 0.8}) {
      const auto rate_at = [&](double x) {
        return width == kFlat ? middle : 1 / (1 + std::exp((x - middle) / width));
      };
      double true_rate = 0;
      for (int i = 0; i < 6000; ++i) true_rate += rate_at((i + 0.5) / 6000) / 6000;
      const std::string name = fmt::format("{} of {}", middle, width);
      const Coverage found = CoverageOf(name, /*strata=*/6, true_rate, rate_at);
      const double z = 1.96 / 0.03, plain = z * z * true_rate * (1 - true_rate);
      if (width <= 0.03 && middle > 0.2) {
        EXPECT_LT(found.trials, 0.35 * plain) << name;
      }
    }
}

TEST(TrialRule, IsThePlansAsTheFileHasIt) {
  const Plan plan(
      "schema_version: 1\nscenario: pool_active\nseeds: 20\nprecision: 0.1\n"
      "grid: {water.milk_ml_m3: [1, 2, 3]}\n",
      "plan.yaml");
  const TrialRule rule = RuleOf(HeaderOf(plan, {}));
  EXPECT_EQ(rule.cells, 3);
  EXPECT_EQ(rule.batch, 20);
  EXPECT_EQ(rule.most, 100);
  EXPECT_EQ(rule.precision, 0.1);
  EXPECT_EQ(rule.strata, 1);
  const Plan in_two(
      "schema_version: 1\nscenario: pool_active\nseeds: 20\nprecision: 0.05\n"
      "strata: {a: {trial.duration_s: 5}, b: {trial.duration_s: 6}}\n",
      "plan.yaml");
  EXPECT_EQ(RuleOf(HeaderOf(in_two, {})).strata, 2);
  const Plan plain("schema_version: 1\nscenario: pool_active\nseeds: 20\n", "plan.yaml");
  EXPECT_EQ(RuleOf(HeaderOf(plain, {})).precision, std::nullopt);
  EXPECT_EQ(RuleOf(HeaderOf(plain, {})).most, 20);
}

// Two lattices of nine cells; success rises over the first, and is certain over the second.
TEST(TrialScheduler, RunsTheTrialsOfASearchHoweverTheyAreRun) {
  const TrialRule rule{.cells = 18,
                       .most = 1000,
                       .precision = {},
                       .search = search::BoundarySearch{
                           .lattice = {{{9, search::Trend::kRises}}}, .rate = 0.7, .most = 60}};
  ExpectTheSameTrialsHoweverTheyAreRun(rule, 41);
}

TEST(TrialScheduler, CountsASearch) {
  const TrialRule rule{
      .cells = 9,
      .most = 1000,
      .precision = {},
      .search = search::BoundarySearch{.lattice = {{{9, search::Trend::kRises}}}, .most = 500}};
  TrialScheduler scheduler(rule, {});
  // of a plan that asked for more before
  scheduler.Add(900 * 9 + 8, true);
  EXPECT_EQ(scheduler.successes(), 0);
  EXPECT_EQ(scheduler.done(), 0);
  EXPECT_EQ(scheduler.most(), 500);
  while (const auto trial = scheduler.Next()) scheduler.Add(*trial, *trial % 9 >= 4);
  EXPECT_TRUE(scheduler.complete());
  EXPECT_EQ(scheduler.cells(), 1);
  EXPECT_LT(scheduler.wanted(), 500);
  EXPECT_EQ(scheduler.most(), scheduler.wanted());
}

}  // namespace
}  // namespace turbidock::batch
