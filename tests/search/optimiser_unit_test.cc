// The optimiser as it is asked here: side by side, repeatable, and able to find a minimum.

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
  Optimise(params, seed, {0.9, 0.9, 0.9},
           [&](int generation, const std::vector<Candidate>& candidates) {
             EXPECT_GE(generation, std::ssize(trace.asked) - 1);
             trace.asked.resize(static_cast<size_t>(generation) + 1);
             std::vector<double> values;
             for (const Candidate& candidate : candidates) {
               trace.asked.back().push_back(candidate);
               for (const double x : candidate) {
                 EXPECT_GE(x, 0);
                 EXPECT_LE(x, 1);
               }
               values.push_back(Bowl(candidate));
               trace.best = std::min(trace.best, values.back());
             }
             return values;
           });
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

}  // namespace
}  // namespace turbidock::search
