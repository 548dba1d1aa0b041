// Two result sets pair by pair, against numbers worked out by hand.

#include "experiments/studies/compare/comparison.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "sim/base/check.h"
#include "tests/support/message_of.h"

namespace turbidock::compare {
namespace {

using ::testing::HasSubstr;
using testing::MessageOf;

class Comparison : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  struct Row {
    int64_t seed;
    bool docked;
    double time_s;
    std::string milk = "10";
  };

  farm::ResultStore Store(const std::string& name, const std::vector<Row>& rows,
                          const std::vector<std::string>& keys = {"water.milk_ml_m3"}) const {
    const std::string file = (folder_ / name).string();
    {
      farm::StoreHeader header;
      header.plan = fmt::format("seeds: {}\nset: {}\n", rows.size(), name);
      header.build = "test";
      header.trials = std::ssize(rows);
      header.keys = keys;
      farm::ResultStore store = farm::ResultStore::Write(file, header);
      for (size_t i = 0; i < rows.size(); ++i) {
        farm::StoredTrial trial;
        for (const std::string& key : keys)
          trial.parameters.push_back({key, key == "water.milk_ml_m3" ? rows[i].milk : "1"});
        trial.trial = static_cast<int64_t>(i);
        trial::TrialRecord& r = trial.record;
        r.seed = rows[i].seed;
        r.outcome = rows[i].docked ? trial::Outcome::kDocked : trial::Outcome::kTimeout;
        r.failure = rows[i].docked ? trial::Failure::kNone : trial::Failure::kTimeout;
        r.docked = r.inserted = rows[i].docked;
        r.time_s = rows[i].time_s;
        r.digest = "0123456789abcdef";
        store.Add(trial);
      }
    }
    return farm::ResultStore::Read(file);
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() /
      (std::string("turbidock_comparison_") +
       ::testing::UnitTest::GetInstance()->current_test_info()->name() + "_" +
       std::to_string(getpid()));
};

// Ten seeds: 6 dock in both, 3 are lost, 1 is gained.
std::vector<TrialPair> TenPairs() {
  std::vector<TrialPair> pairs(10);
  for (int i = 0; i < 10; ++i) {
    trial::TrialRecord &a = pairs[static_cast<size_t>(i)].a, &b = pairs[static_cast<size_t>(i)].b;
    a.seed = b.seed = i;
    a.failure = i < 9 ? trial::Failure::kNone : trial::Failure::kTimeout;
    b.failure = i < 6 || i == 9 ? trial::Failure::kNone : trial::Failure::kTimeout;
    a.time_s = 10;
    b.time_s = 10 + i - 1;  // one faster, one equal, four slower among those that dock in both
  }
  return pairs;
}

TEST_F(Comparison, RatesOfTenPairs) {
  const RateComparison c = CompareRates(TenPairs());
  EXPECT_EQ(c.pairs, 10);
  EXPECT_EQ(c.lost, 3);
  EXPECT_EQ(c.gained, 1);
  EXPECT_DOUBLE_EQ(c.rate_a, 0.9);
  EXPECT_DOUBLE_EQ(c.rate_b, 0.7);
  EXPECT_NEAR(c.difference, -0.2, 1e-15);
  // P(at most 1 of 4 fair flips), twice: 2 (1 + 4) / 16
  EXPECT_DOUBLE_EQ(c.p_value, 0.625);
  // (1.5 - 3.5) / 12 and 1.959964 sqrt(5 - 4 / 12) / 12
  EXPECT_NEAR(c.interval_95.low, -1.0 / 6 - 0.352834, 1e-5);
  EXPECT_NEAR(c.interval_95.high, -1.0 / 6 + 0.352834, 1e-5);
}

TEST_F(Comparison, TimesOfTenPairs) {
  const MetricComparison c = CompareMetric(TenPairs(), MetricNamed("time_s"));
  EXPECT_EQ(c.pairs, 6);
  EXPECT_EQ(c.larger, 4);
  EXPECT_EQ(c.smaller, 1);
  EXPECT_DOUBLE_EQ(*c.median_a, 10);
  EXPECT_DOUBLE_EQ(*c.median_difference, 1.5);
  EXPECT_DOUBLE_EQ(c.p_value, 2 * (1.0 + 5) / 32);
  // of six values only the outermost two bound the median with 95 %: 2 / 64 are outside
  ASSERT_TRUE(c.interval_95);
  EXPECT_DOUBLE_EQ(c.interval_95->low, -1);
  EXPECT_DOUBLE_EQ(c.interval_95->high, 4);
  EXPECT_THAT(MessageOf([] { MetricNamed("time"); }),
              AllOf(HasSubstr("no metric"), HasSubstr("did you mean time_s?")));
}

// Only pairs in which both docked and both have it are compared.
TEST_F(Comparison, AMetricThatOneTrialOfAPairLacks) {
  std::vector<TrialPair> pairs = TenPairs();
  const trial::Metric time{"time_s", [](const trial::TrialRecord& record) {
                             return record.time_s < 0 ? std::nullopt : std::optional(record.time_s);
                           }};
  EXPECT_EQ(CompareMetric(pairs, time).pairs, 6);
  pairs[0].b.time_s = -1;
  EXPECT_EQ(CompareMetric(pairs, time).pairs, 5);
  pairs[1].a.time_s = -1;
  EXPECT_EQ(CompareMetric(pairs, time).pairs, 4);
  EXPECT_DOUBLE_EQ(*CompareMetric(pairs, time).median_a, 10);
}

TEST_F(Comparison, TrialsPairBySeedAndParameters) {
  const farm::ResultStore a = Store("a.db", {{1, true, 30}, {2, true, 31}, {1, false, 60, "20"}});
  const farm::ResultStore b = Store("b.db", {{1, false, 60, "20"}, {3, true, 1}, {1, true, 33}});
  const auto pairs = PairTrials(a, b, {});
  ASSERT_EQ(pairs.size(), 2u);
  const auto groups = GroupPairs(pairs, {"water.milk_ml_m3"});
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(GroupName(groups[0]), "water.milk_ml_m3=10");
  EXPECT_EQ(groups[0].pairs.at(0).a.time_s, 30);
  EXPECT_EQ(groups[0].pairs.at(0).b.time_s, 33);
  EXPECT_EQ(GroupName(GroupPairs(pairs, {}).at(0)), "all");
}

TEST_F(Comparison, WhatDiffersOnPurposeIsIgnored) {
  const farm::ResultStore a = Store("a.db", {{1, true, 30}}),
                          b = Store("b.db", {{1, true, 30, "20"}});
  EXPECT_THAT(MessageOf([&] { PairTrials(a, b, {}); }), HasSubstr("no trial of one set"));
  EXPECT_EQ(PairTrials(a, b, {.by = {}, .ignore = {"water.milk_ml_m3"}}).size(), 1u);
  // a parameter of one set only, in which its trials differ
  const farm::ResultStore c = Store("c.db", {{1, true, 30}, {1, true, 30, "20"}});
  const farm::ResultStore plain = Store("plain.db", {{1, true, 30}}, {});
  EXPECT_THAT(MessageOf([&] { PairTrials(c, plain, {}); }), HasSubstr("several trials"));
  EXPECT_THAT(MessageOf([&] { PairTrials(a, b, {.by = {"water.milk"}, .ignore = {}}); }),
              HasSubstr("did you mean water.milk_ml_m3?"));
}

TEST_F(Comparison, TheFigureIsDrawnAlsoWhereNothingDocks) {
  std::vector<TrialPair> pairs = TenPairs();
  const std::string path = (folder_ / "figure.png").string();
  WriteComparisonFigure(path, GroupPairs(pairs, {}), "a", "b");
  EXPECT_GT(std::filesystem::file_size(path), 1000u);
  for (TrialPair& pair : pairs) pair.a.failure = trial::Failure::kTimeout;
  WriteComparisonFigure(path, GroupPairs(pairs, {}), "a", "b");
  EXPECT_GT(std::filesystem::file_size(path), 1000u);
}

}  // namespace
}  // namespace turbidock::compare
