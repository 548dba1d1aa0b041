// The optimisers as they are asked here: side by side, repeatable, and able to find a minimum.

#include "experiments/search/optimiser.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "sim/base/check.h"

namespace turbidock::search {
namespace {

double Bowl(const Candidate& x) {
  double sum = 0;
  for (size_t i = 0; i < x.size(); ++i)
    sum += std::pow(x[i] - 0.2 - 0.1 * static_cast<double>(i), 2);
  return sum;
}

struct Trace {
  std::vector<std::vector<Candidate>> asked;  // by generation
  double best = 1e30;
};

Trace TraceOf(const OptimiserParams& params, uint64_t seed) {
  Trace trace;
  Optimise(
      params, seed, {0.9, 0.9, 0.9}, 1,
      [&](int generation, const std::vector<Candidate>& candidates) {
        EXPECT_GE(generation, std::ssize(trace.asked) - 1);
        trace.asked.resize(static_cast<size_t>(generation) + 1);
        std::vector<Worth> worths;
        for (const Candidate& candidate : candidates) {
          trace.asked.back().push_back(candidate);
          for (const double x : candidate) {
            EXPECT_GE(x, 0);
            EXPECT_LE(x, 1);
          }
          worths.push_back({Bowl(candidate)});
          trace.best = std::min(trace.best, worths.back()[0]);
        }
        return worths;
      },
      nullptr);
  return trace;
}

TEST(CmaEs, FindsTheBottomOfABowlAskingGenerationsAtATime) {
  const OptimiserParams params{.population = 16, .generations = 40};
  const Trace trace = TraceOf(params, 5);
  ASSERT_EQ(trace.asked.size(), 41u);
  EXPECT_EQ(trace.asked[0][0], Candidate({0.9, 0.9, 0.9}));  // the start comes first
  for (size_t generation = 1; generation < trace.asked.size(); ++generation)
    EXPECT_EQ(trace.asked[generation].size(), 16u) << generation;  // none asked for alone
  EXPECT_LT(trace.best, 1e-3);
}

TEST(CmaEs, SameSeedSameQuestions) {
  const OptimiserParams params{.population = 8, .generations = 5};
  EXPECT_EQ(TraceOf(params, 3).asked, TraceOf(params, 3).asked);
  EXPECT_NE(TraceOf(params, 3).asked, TraceOf(params, 4).asked);
}

TEST(Nsga2, FindsTheFrontOfTwoObjectives) {
  // distances to two corners: the front is the diagonal between them
  std::vector<Worth> all;
  const OptimiserParams params{.algorithm = Algorithm::kNsga2, .population = 24, .generations = 30};
  Optimise(
      params, 2, {0.1, 0.9}, 2,
      [&](int, const std::vector<Candidate>& candidates) {
        std::vector<Worth> worths;
        for (const Candidate& x : candidates)
          worths.push_back({std::hypot(x[0], x[1]), std::hypot(1 - x[0], 1 - x[1])});
        all.insert(all.end(), worths.begin(), worths.end());
        return worths;
      },
      nullptr);
  const std::vector<size_t> front = ParetoFront(all);
  EXPECT_GT(front.size(), 10u);
  int near = 0;
  for (const size_t i : front) near += all[i][0] + all[i][1] < 1.02 * std::sqrt(2.0);
  EXPECT_GT(near, std::ssize(front) * 8 / 10);
}

TEST(ParetoFront, KeepsWhatNothingBeatsInEverything) {
  EXPECT_EQ(ParetoFront({{1, 3}, {2, 2}, {3, 1}, {3, 3}, {2, 2}}),
            (std::vector<size_t>{0, 1, 2, 4}));
  EXPECT_TRUE(ParetoFront({}).empty());
}

TEST(OptimiserParams, PopulationsThatAnAlgorithmCannotUse) {
  EXPECT_THROW(CheckFields(OptimiserParams{.algorithm = Algorithm::kNsga2, .population = 10}, ""),
               ConfigError);
  EXPECT_NO_THROW(CheckFields(OptimiserParams{}, ""));
}

}  // namespace
}  // namespace turbidock::search
