// How often the band of a search holds a made-up boundary: assets/measured/envelope_coverage.csv.
//
//   envelope_coverage RANGES line|curve|corner|step FIRST_SEED REPETITIONS

#include <fmt/format.h>

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
  if (truth == "corner") return Logistic(2.2 - 20 * (most - 0.6 - shift));
  return radius < 0 ? 0.97 : 0.3;
}

struct Found {
  int64_t trials = 0;
  bool held = true, nearly = true, reached = false;
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
  constexpr std::array<std::string_view, 4> kTruths = {"line", "curve", "corner", "step"};
  if (argc != 5 || std::ranges::count(kTruths, argv[2]) == 0) {
    fmt::print(stderr, "envelope_coverage RANGES line|curve|corner|step FIRST_SEED REPETITIONS\n");
    return 2;
  }
  const int ranges = std::clamp(std::atoi(argv[1]), 1, 3);
  const int values[] = {41, 21, 11};
  const uint64_t first = std::strtoull(argv[3], nullptr, 10);
  const int repetitions = std::max(1, std::atoi(argv[4]));
  BoundarySearch search{.width = 0.1, .most = 5000};
  for (int i = 0; i < ranges; ++i)
    search.lattice.axes.push_back({.values = values[ranges - 1], .trend = Trend::kFalls});
  int held = 0, nearly = 0, reached = 0;
  double trials = 0, choosing_s = 0;
  for (int i = 0; i < repetitions; ++i) {
    const Found found = Search(search, argv[2], first + static_cast<uint64_t>(i));
    held += found.held;
    nearly += found.nearly;
    reached += found.reached;
    trials += static_cast<double>(found.trials) / repetitions;
    choosing_s += found.choosing_s / repetitions;
  }
  fmt::print("{},{},{} of {},{} of {},{} of {},{:.0f},{:.2g}\n", ranges, argv[2], held, repetitions,
             nearly, repetitions, reached, repetitions, trials, choosing_s);
  return 0;
}
