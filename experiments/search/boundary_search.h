#pragma once
// Where does success fall below a rate? Trials on a lattice of conditions, chosen where they tell
// most about that boundary, and what they say of it. Knows nothing of what the conditions are.
//
// It goes in rounds. The first covers the space evenly (a Halton sequence). Each later one is as
// large as a sixth of the trials before it, at least 8. Nine in ten trials go where they are
// expected to reduce the doubt about the boundary most (targeted mean square error: Picheny et al.,
// J. Mech. Des. 132 (2010) 071008; stepwise reduction of uncertainty: Bect et al., Stat. Comput. 22
// (2012) 773), each as if those before it had been run already. Every tenth follows the even
// sequence on, wherever the boundary is: these find holes, islands and what is not monotone. A
// round depends on the tallies of the rounds before it and on nothing else.

#include <cstdint>
#include <vector>

#include "sim/base/fields.h"

namespace turbidock::search {

enum class Trend { kUnknown, kFalls, kRises };
constexpr auto Names(Trend) {
  using enum Trend;
  return EnumList<Trend>({{kUnknown, "unknown"}, {kFalls, "falls"}, {kRises, "rises"}});
}

struct LatticeAxis {
  int values = 2;
  Trend trend = Trend::kUnknown;  // of success towards the higher values
};

// Cells in as many dimensions as it has axes; the last axis varies fastest.
struct Lattice {
  std::vector<LatticeAxis> axes = {};

  int cells() const;
  std::vector<int> At(int cell) const;  // its place on each axis
  int Step(size_t axis) const;          // from a cell to its neighbour along that axis
};

// Of a cell.
struct Tally {
  int64_t successes = 0, trials = 0;
};

struct BoundarySearch {
  Lattice lattice = {};
  double rate = 0.9;   // in (0, 1): the boundary is where success crosses it
  double width = 0.1;  // the search ends when no more than this share of the cells is undecided
  int64_t most = 1'000'000;      // trials: or after so many
  int64_t most_of_cell = 1'000;  // no more trials of a cell than that
};

enum class Side : int8_t { kBelow = -1, kUndecided = 0, kAbove = 1 };

// What tallies say of a boundary.
struct Boundary {
  // Of each cell: whether its rate is above or below, all of these together right with 95 % (the
  // excursion sets of Bolin and Lindgren, J. R. Stat. Soc. B 77 (2015) 85). The undecided cells are
  // the band that holds the boundary.
  std::vector<Side> sides = {};
  std::vector<double> above = {};  // of each cell: probability that its rate is above
  // Of each cell: posterior median, 95 % interval. By a model of its own, which learns less from
  // the trials near the boundary about the rest (Variation::kMuch).
  std::vector<double> rate = {}, low = {}, high = {};
  double undecided = 1;  // share of the cells
  // Log odds less those of the rate looked for, draw by draw, each over all cells.
  std::vector<std::vector<float>> draws = {};
};
Boundary BoundaryOf(const BoundarySearch& search, const std::vector<Tally>& tallies);

// The size of the round after so many trials.
int64_t RoundAfter(const Lattice& lattice, int64_t trials);

// The cells of the next round, each as often as it is to be run; empty when the boundary is known
// well enough or cannot be. `tallies`: of all rounds before. `run`: how many trials of each cell
// these rounds had; some may have come to nothing.
std::vector<int> NextRound(const BoundarySearch& search, const std::vector<Tally>& tallies,
                           std::vector<int64_t> run);

}  // namespace turbidock::search
