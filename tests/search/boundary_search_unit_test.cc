// Finding where success falls below a rate, on known rates: the band holds the boundary as often as
// it says, and takes few trials.

#include "experiments/search/boundary_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "experiments/search/boundary_difference.h"
#include "experiments/search/boundary_model.h"
#include "sim/base/random.h"

namespace turbidock::search {
namespace {

using Rate = std::function<double(const std::vector<double>&)>;  // at a place in the unit cube

double Logistic(double x) { return 1 / (1 + std::exp(-x)); }

Lattice LatticeOf(int axes, int values, Trend trend) {
  return {std::vector<LatticeAxis>(static_cast<size_t>(axes), {values, trend})};
}

std::vector<double> RatesOf(const Lattice& lattice, const Rate& rate) {
  std::vector<double> rates;
  for (int cell = 0; cell < lattice.cells(); ++cell) {
    std::vector<double> place;
    for (const int at : lattice.At(cell))
      place.push_back(at / static_cast<double>(lattice.axes[0].values - 1));
    rates.push_back(rate(place));
  }
  return rates;
}

// A search to its end, of trials by lot.
struct Searched {
  std::vector<Tally> tallies;
  std::vector<int64_t> run;
  int64_t trials = 0;
};

Searched Search(const BoundarySearch& search, const std::vector<double>& rates, uint64_t seed) {
  Rng rng = SeedTree(seed).Stream("trials");
  Searched done{.tallies = std::vector<Tally>(rates.size()),
                .run = std::vector<int64_t>(rates.size())};
  for (;;) {
    const std::vector<int> cells = NextRound(search, done.tallies, done.run);
    if (cells.empty()) return done;
    for (const int cell : cells) {
      Tally& tally = done.tallies[static_cast<size_t>(cell)];
      ++tally.trials, ++done.run[static_cast<size_t>(cell)], ++done.trials;
      tally.successes += rng.Uniform() < rates[static_cast<size_t>(cell)];
    }
  }
}

// In how many of so many searches no cell is on the wrong side; their trials, on average.
struct Coverage {
  int held = 0;
  double trials = 0;
};

Coverage CoverageOf(const BoundarySearch& search, const std::function<Rate(double)>& truth,
                    int searches) {
  Coverage coverage;
  for (int i = 0; i < searches; ++i) {
    const double shift = 0.2 * SeedTree(static_cast<uint64_t>(i)).Stream("shift").Uniform() - 0.1;
    const std::vector<double> rates = RatesOf(search.lattice, truth(shift));
    const Searched done = Search(search, rates, static_cast<uint64_t>(i));
    const Boundary boundary = BoundaryOf(search, done.tallies);
    bool held = true;
    for (size_t c = 0; c < rates.size(); ++c)
      held = held && boundary.sides[c] != (rates[c] >= search.rate ? Side::kBelow : Side::kAbove);
    coverage.held += held;
    coverage.trials += static_cast<double>(done.trials) / searches;
    EXPECT_LE(boundary.undecided, search.width);
  }
  return coverage;
}

// Fewer than 51 of 60 are held by chance once in 1000 where 95 % are.
TEST(BoundarySearch, BandHoldsALineAPlateauAndAStep) {
  const BoundarySearch search{.lattice = LatticeOf(1, 41, Trend::kFalls)};
  const auto line = [](double shift) -> Rate {
    return [shift](const auto& x) { return Logistic(2.2 - 12 * (x[0] - 0.5 - shift)); };
  };
  const auto plateau = [](double shift) -> Rate {
    return [shift](const auto& x) {
      const double beyond = x[0] - 0.5 - shift;
      return beyond < 0 ? 0.97 : 1.075 * Logistic(2.2 - 20 * beyond);
    };
  };
  const auto step = [](double shift) -> Rate {
    return [shift](const auto& x) { return x[0] < 0.5 + shift ? 0.97 : 0.3; };
  };
  for (const auto& truth : std::vector<std::function<Rate(double)>>{line, plateau, step}) {
    const Coverage coverage = CoverageOf(search, truth, 30);
    EXPECT_GE(coverage.held, 26);
    EXPECT_LE(coverage.trials, 400);
  }
}

TEST(BoundarySearch, BandHoldsACurveInTwoDimensions) {
  const BoundarySearch search{.lattice = LatticeOf(2, 15, Trend::kFalls), .width = 0.15};
  const auto curve = [](double shift) -> Rate {
    return [shift](const auto& x) {
      return Logistic(2.2 - 20 * (std::hypot(x[0], x[1]) - 0.7 - shift));
    };
  };
  EXPECT_GE(CoverageOf(search, curve, 6).held, 5);
}

// As many trials everywhere, so that nothing but the model decides. A smooth kernel puts the tip on
// the wrong side in 8 of these 20.
TEST(BoundaryOf, IsSeldomSureOfTheWrongSideOfACorner) {
  const BoundarySearch search{.lattice = LatticeOf(2, 21, Trend::kFalls)};
  const std::vector<double> rates = RatesOf(search.lattice, [](const auto& x) {
    return Logistic(2.6 - 1.2 * (20 * std::max(x[0], x[1]) - 12));
  });
  int wrong = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng = SeedTree(seed).Stream("lots");
    std::vector<Tally> tallies(rates.size(), {.trials = 4});
    for (size_t c = 0; c < rates.size(); ++c)
      for (int i = 0; i < 4; ++i) tallies[c].successes += rng.Uniform() < rates[c];
    const size_t tip = 12 * 21 + 12;  // success is 0.93 there, below 0.9 farther on
    wrong += BoundaryOf(search, tallies).sides[tip] == Side::kBelow;
  }
  EXPECT_LE(wrong, 4);
}

// Most trials are where success falls slowly; a model of these alone is sure of wrong rates about
// the cliff, and holds 90 of 100.
TEST(BoundaryOf, TellsRatesFarFromTheBoundaryThatHold) {
  const BoundarySearch search{.lattice = LatticeOf(1, 41, Trend::kFalls)};
  const std::vector<double> rates = RatesOf(search.lattice, [](const auto& x) {
    return Logistic(2.2 - 6 * (x[0] - 0.35)) * (x[0] > 0.75 ? 0.07 : 1);
  });
  double held = 0;
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const Boundary boundary = BoundaryOf(search, Search(search, rates, seed).tallies);
    for (size_t c = 0; c < rates.size(); ++c)
      held += boundary.low[c] - 0.01 <= rates[c] && rates[c] <= boundary.high[c] + 0.01;
  }
  EXPECT_GE(held / (40 * 41), 0.93);
}

TEST(BoundarySearch, ChoosesTrialsNearTheBoundaryButForChecks) {
  // narrow enough that the first round, which is even, is a small part
  const BoundarySearch search{.lattice = LatticeOf(1, 41, Trend::kFalls), .width = 0.05};
  const std::vector<double> rates =
      RatesOf(search.lattice, [](const auto& x) { return Logistic(2.2 - 40 * (x[0] - 0.5)); });
  const Searched done = Search(search, rates, 1);
  int64_t near = 0;
  for (size_t cell = 14; cell <= 27; ++cell) near += done.run[cell];
  EXPECT_GE(static_cast<double>(near), 0.6 * static_cast<double>(done.trials));
  int64_t beyond = 0;  // the first round and checks
  for (size_t cell = 0; cell < 8; ++cell) beyond += done.run[cell];
  EXPECT_GE(beyond, 6);
}

TEST(BoundarySearch, SaysThatAllOrNoneIsAbove) {
  for (const double rate : {0.999, 0.02}) {
    const BoundarySearch search{.lattice = LatticeOf(2, 9, Trend::kUnknown)};
    const std::vector<double> rates = RatesOf(search.lattice, [rate](const auto&) { return rate; });
    const Searched done = Search(search, rates, 3);
    const Boundary boundary = BoundaryOf(search, done.tallies);
    EXPECT_EQ(std::ranges::count(boundary.sides, rate > 0.5 ? Side::kBelow : Side::kAbove), 0);
    EXPECT_LE(boundary.undecided, 0.1);
  }
}

TEST(BoundarySearch, FindsAHole) {
  const BoundarySearch search{.lattice = LatticeOf(1, 41, Trend::kUnknown)};
  const std::vector<double> rates = RatesOf(
      search.lattice, [](const auto& x) { return std::abs(x[0] - 0.5) < 0.1 ? 0.2 : 0.99; });
  const Boundary boundary = BoundaryOf(search, Search(search, rates, 5).tallies);
  EXPECT_EQ(boundary.sides[20], Side::kBelow);
  EXPECT_EQ(boundary.sides[5], Side::kAbove);
  EXPECT_EQ(boundary.sides[35], Side::kAbove);
}

TEST(BoundarySearch, EndsAfterTheMostTrialsAndRunsNoCellMoreOften) {
  BoundarySearch search{.lattice = LatticeOf(1, 5, Trend::kUnknown), .width = 0};
  search.most_of_cell = 30;
  const Searched all = Search(search, {0.9, 0.9, 0.9, 0.9, 0.9}, 1);
  EXPECT_LE(std::ranges::max(all.run), 30);
  search.most = 50;
  EXPECT_EQ(Search(search, {0.9, 0.9, 0.9, 0.9, 0.9}, 1).trials, 50);
}

// ------------------------------------------------------------------------------- a difference

// Where success crosses, in cells, draw by draw.
std::vector<double> PlacesOf(const Boundary& boundary) {
  std::vector<double> places;
  for (const auto& draw : boundary.draws) {
    size_t i = 1;
    while (i + 1 < draw.size() && draw[i] >= 0) ++i;
    places.push_back(static_cast<double>(i - 1) +
                     static_cast<double>(draw[i - 1] / (draw[i - 1] - draw[i])));
  }
  return places;
}

// 30 trials a cell with A and with B, where 90 % is 1.6 cells earlier. With `common` the same lot
// decides both trials of a pair: near the boundary these correlate by 0.7.
struct TwoBoundaries {
  TwoBoundaries(uint64_t seed, bool common) {
    const Lattice lattice = LatticeOf(1, 41, Trend::kFalls);
    const BoundarySearch search{.lattice = lattice};
    std::vector<Tally> tallies_a(41), tallies_b(41);
    Rng rng = SeedTree(seed).Stream("lots");
    for (int cell = 0; cell < 41; ++cell)
      for (int i = 0; i < 30; ++i) {
        const auto rate = [&](double boundary) {
          return Logistic(2.1972 - 0.4 * (cell - boundary));
        };
        const double lot = rng.Uniform(), other = rng.Uniform();
        pairs.push_back({cell, lot < rate(20.2), (common ? lot : other) < rate(18.6)});
        for (const auto& [tally, success] :
             {std::pair{&tallies_a, pairs.back().a}, {&tallies_b, pairs.back().b}}) {
          Tally& of = (*tally)[static_cast<size_t>(cell)];
          ++of.trials, of.successes += success;
        }
      }
    a = BoundaryOf(search, tallies_a);
    b = BoundaryOf(search, tallies_b);
  }
  Difference Of(const std::vector<TrialPair>& known) const {
    return DifferenceOf(a, PlacesOf(a), b, PlacesOf(b), known);
  }

  Boundary a, b;
  std::vector<TrialPair> pairs;
};

// Fewer than 51 of 60 are held by chance once in 1000 where 95 % are. Pairs that have the lot in
// common make the interval narrower.
TEST(DifferenceOf, HoldsTheDifferenceAndIsNarrowerWherePairsHaveMuchInCommon) {
  for (const bool common : {false, true}) {
    int held = 0;
    double width = 0, alone = 0, correlation = 0;
    for (uint64_t seed = 0; seed < 60; ++seed) {
      const TwoBoundaries two(seed, common);
      const Difference paired = two.Of(two.pairs), independent = two.Of({});
      EXPECT_EQ(independent.correlation, 0);
      held += paired.low <= -1.6 && -1.6 <= paired.high;
      width += paired.high - paired.low;
      alone += independent.high - independent.low;
      correlation += paired.correlation / 60;
    }
    EXPECT_GE(held, 51);
    if (common)
      EXPECT_LT(width, 0.8 * alone);
    else
      EXPECT_NEAR(width, alone, 0.1 * alone);
    EXPECT_NEAR(correlation, common ? 0.6 : 0, common ? 0.35 : 0.1);
  }
}

// ------------------------------------------------------------------------------------ the model

// No monotone function is nearer: by small random moves that stay monotone.
TEST(MakeMonotone, IsTheNearestMonotoneFunction) {
  Lattice lattice{{{4, Trend::kFalls}, {3, Trend::kRises}}};
  Rng rng = SeedTree(7).Stream("values");
  Eigen::VectorXd values(12), weights(12);
  for (int i = 0; i < 12; ++i) values[i] = rng.Normal(), weights[i] = rng.Uniform(0.5, 2);
  Eigen::VectorXd nearest = values;
  MakeMonotone(lattice, weights, &nearest);
  const auto violation = [&](const Eigen::VectorXd& v) {
    double most = 0;
    for (int cell = 0; cell < 12; ++cell) {
      const std::vector<int> at = lattice.At(cell);
      if (at[0] < 3) most = std::max(most, v[cell + 3] - v[cell]);
      if (at[1] < 2) most = std::max(most, v[cell] - v[cell + 1]);
    }
    return most;
  };
  const auto cost = [&](const Eigen::VectorXd& v) {
    return ((v - values).array().square() * weights.array()).sum();
  };
  EXPECT_GT(violation(values), 0.1);
  EXPECT_LT(violation(nearest), 0.05);
  for (int i = 0; i < 2000; ++i) {
    Eigen::VectorXd moved = nearest;
    for (double& value : moved) value += 0.1 * rng.Normal();
    if (violation(moved) > 0) continue;
    EXPECT_GE(cost(moved), cost(nearest) - 0.05);
  }
}

TEST(DrawLogOdds, FollowsTheTrialsAndKnowsLessFarFromThem) {
  const Lattice lattice = LatticeOf(1, 21, Trend::kUnknown);
  std::vector<Tally> tallies(21);
  for (size_t cell = 0; cell < 8; ++cell) tallies[cell] = {80, 100};
  const Eigen::MatrixXd draws = DrawLogOdds(lattice, tallies, 500);
  const auto spread = [&](int cell) {
    const Eigen::ArrayXd row = draws.row(cell);
    return std::sqrt((row - row.mean()).square().mean());
  };
  EXPECT_NEAR(draws.row(4).mean(), std::log(4.0), 0.2);
  EXPECT_LT(spread(4), 0.3);
  EXPECT_GT(spread(20), 3 * spread(4));
}

}  // namespace
}  // namespace turbidock::search
