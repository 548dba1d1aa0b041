// How often the band of a search holds a made-up boundary: assets/measured/envelope_coverage.csv.
//
//   envelope_coverage RANGES BOUNDARY FIRST_SEED REPETITIONS
//
// A line a search: ranges, boundary, seed, held, held but for 0.019, reached the width, share of
// the cells whose told interval holds the rate within 0.01, trials, processor seconds of choosing.
// Each seed is a search of its own, so processes may share them; of 100 in two ranges on 16 cores,
// with their means by column:
//
//   for s in $(seq 0 99); do echo 2 corner $((30000 + s)) 1; done |
//     xargs -P16 -L1 envelope_coverage | tee searches.csv |
//     awk -F, '{for (i = 4; i <= 9; ++i) s[i] += $i} END {for (i in s) print i, s[i] / NR}'

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

#include "experiments/search/boundary_search.h"
#include "sim/base/random.h"

namespace {

using namespace turbidock;
using namespace turbidock::search;

double Logistic(double odds) { return 1 / (1 + std::exp(-odds)); }

// Success at a place in [0, 1]^n; it falls along each range. `shift` moves the boundary.
double RateAt(const std::string& truth, const std::vector<double>& place, double shift) {
  double sum = 0, squares = 0, most = 0;
  for (const double x : place) {
    sum += x;
    squares += x * x;
    most = std::max(most, x);
  }
  const auto n = static_cast<double>(place.size());
  const double radius = std::sqrt(squares / n) - 0.5 - shift;
  if (truth == "line") return Logistic(2.2 - 12 * (sum / n - 0.45 - shift));
  if (truth == "curve") return Logistic(2.2 - 15 * radius);
  // the rate is known well before the cliff, seldom tried beyond it
  if (truth == "cliff")
    return Logistic(2.2 - 6 * (sum / n - 0.35 - shift)) * (sum / n > 0.75 + shift ? 0.07 : 1);
  if (truth == "plateau") {
    const double mean = sum / n - shift;
    return 0.97 - 0.37 * Logistic(30 * (mean - 0.4)) - 0.5 * Logistic(30 * (mean - 0.8));
  }
  // steep at one end of the last range, not at the other
  if (truth == "fan") {
    const double y = n > 1 ? place.back() : 0;
    return Logistic(2.2 - (60 - 50 * y) * (place[0] - 0.6 + 0.3 * y - shift));
  }
  if (truth == "corner") return Logistic(2.2 - 20 * (most - 0.6 - shift));
  return radius < 0 ? 0.97 : 0.3;
}

struct Found {
  int64_t trials = 0;
  bool held = true, nearly = true, reached = false;
  double rates_held = 0;  // share of the cells
  double choosing_s = 0;  // of processor time
};

Found Search(const BoundarySearch& search, const std::string& truth, uint64_t seed) {
  constexpr double kTold = 0.019;  // of a rate of 0.9, by 1,000 trials
  Rng rng = SeedTree(seed).Stream("sim");
  const double shift = 0.2 * (rng.Uniform() - 0.5);
  std::vector<double> rates;
  for (int cell = 0; cell < search.lattice.cells(); ++cell) {
    std::vector<double> place;
    for (const int at : search.lattice.At(cell))
      place.push_back(at / (search.lattice.axes[0].values - 1.0));
    rates.push_back(RateAt(truth, place, shift));
  }
  std::vector<Tally> tallies(rates.size());
  std::vector<int64_t> run(rates.size());
  Found found;
  for (;;) {
    const std::clock_t begin = std::clock();
    const std::vector<int> cells = NextRound(search, tallies, run);
    found.choosing_s += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    if (cells.empty()) break;
    for (const int cell : cells) {
      const auto c = static_cast<size_t>(cell);
      ++run[c], ++tallies[c].trials, ++found.trials;
      tallies[c].successes += rng.Uniform() < rates[c];
    }
  }
  const Boundary boundary = BoundaryOf(search, tallies);
  for (size_t c = 0; c < rates.size(); ++c) {
    const double over = rates[c] - search.rate;
    constexpr double kNear = 0.01;
    if (boundary.low[c] - kNear <= rates[c] && rates[c] <= boundary.high[c] + kNear)
      found.rates_held += 1 / static_cast<double>(rates.size());
    if (boundary.sides[c] == (over >= 0 ? Side::kBelow : Side::kAbove)) {
      found.held = false;
      found.nearly &= std::abs(over) <= kTold;
    }
  }
  found.reached = boundary.undecided <= search.width;
  return found;
}

}  // namespace

int main(int argc, char** argv) {
  constexpr std::array<std::string_view, 7> kTruths = {"line",  "curve",   "corner", "step",
                                                       "cliff", "plateau", "fan"};
  if (argc != 5 || std::ranges::count(kTruths, argv[2]) == 0) {
    fmt::print(stderr, "envelope_coverage RANGES {} FIRST_SEED REPETITIONS\n",
               fmt::join(kTruths, "|"));
    return 2;
  }
  const int ranges = std::clamp(std::atoi(argv[1]), 1, 3);
  const int values[] = {41, 21, 11};
  const uint64_t first = std::strtoull(argv[3], nullptr, 10);
  const int repetitions = std::max(1, std::atoi(argv[4]));
  BoundarySearch search{.width = 0.1, .most = 5000};
  for (int i = 0; i < ranges; ++i)
    search.lattice.axes.push_back({.values = values[ranges - 1], .trend = Trend::kFalls});
  for (uint64_t seed = first; seed < first + static_cast<uint64_t>(repetitions); ++seed) {
    const Found found = Search(search, argv[2], seed);
    fmt::print("{},{},{},{:d},{:d},{:d},{:.3f},{},{:.2g}\n", ranges, argv[2], seed, found.held,
               found.nearly, found.reached, found.rates_held, found.trials, found.choosing_s);
  }
  return 0;
}
