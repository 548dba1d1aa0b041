#include "experiments/search/boundary_search.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "experiments/search/boundary_model.h"
#include "sim/base/check.h"

namespace turbidock::search {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kConfidence = 0.95;
constexpr int kDraws = 1000;
constexpr int kCheckEvery = 10;
constexpr int kMostCandidates = 250;

double LogOdds(double p) { return std::log(p / (1 - p)); }

// The so manieth point of the Halton sequence in bases 2, 3, 5, as a cell.
int EvenCell(const Lattice& lattice, int64_t number) {
  constexpr std::array kBases{2, 3, 5};
  int cell = 0;
  for (size_t k = 0; k < lattice.axes.size(); ++k) {
    double share = 0, digit = 1;
    for (int64_t rest = number + 1; rest > 0; rest /= kBases[k]) {
      digit /= kBases[k];
      share += digit * static_cast<double>(rest % kBases[k]);
    }
    const int n = lattice.axes[k].values;
    cell = cell * n + std::min(n - 1, static_cast<int>(share * n));
  }
  return cell;
}

int FirstRound(const Lattice& lattice) {
  constexpr std::array kFirst{24, 48, 96};
  return kFirst.at(lattice.axes.size() - 1);
}

// Decides as many cells as are right together, the surest first. `draws`: log odds above those
// looked for.
std::vector<Side> SidesOf(const MatrixXd& draws, const VectorXd& above) {
  const auto cells = draws.rows(), count = draws.cols();
  std::vector<Eigen::Index> order(static_cast<size_t>(cells));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater(),
                           [&](Eigen::Index c) { return std::abs(above[c] - 0.5); });
  // How many cells of that order each draw agrees with until the first that it does not.
  std::vector<Eigen::Index> agree;
  for (Eigen::Index i = 0; i < count; ++i) {
    Eigen::Index k = 0;
    while (k < cells) {
      const Eigen::Index c = order[static_cast<size_t>(k)];
      if ((draws(c, i) >= 0) != (above[c] >= 0.5)) break;
      ++k;
    }
    agree.push_back(k);
  }
  std::ranges::sort(agree);
  const Eigen::Index decided =
      agree[static_cast<size_t>((1 - kConfidence) * static_cast<double>(count))];
  std::vector<Side> sides(static_cast<size_t>(cells), Side::kUndecided);
  for (Eigen::Index k = 0; k < decided; ++k) {
    const Eigen::Index c = order[static_cast<size_t>(k)];
    sides[static_cast<size_t>(c)] = above[c] >= 0.5 ? Side::kAbove : Side::kBelow;
  }
  return sides;
}

VectorXd ShareAbove(const MatrixXd& draws) {
  return (draws.array() >= 0).cast<double>().rowwise().mean();
}

double ShareUndecided(const std::vector<Side>& sides) {
  return static_cast<double>(std::ranges::count(sides, Side::kUndecided)) /
         static_cast<double>(sides.size());
}

// The cells nearest to the boundary in standard deviations, with what is known of them.
class Doubt {
 public:
  Doubt(const MatrixXd& draws, double level) {
    const VectorXd mean = draws.rowwise().mean();
    const VectorXd deviation =
        ((draws.colwise() - mean).rowwise().squaredNorm() / static_cast<double>(draws.cols()))
            .cwiseMax(1e-12)
            .cwiseSqrt();
    const VectorXd distance = mean.cwiseAbs().cwiseQuotient(deviation);
    cells_.resize(static_cast<size_t>(mean.size()));
    std::iota(cells_.begin(), cells_.end(), 0);
    std::ranges::stable_sort(cells_, {}, [&](int c) { return distance[c]; });
    cells_.resize(std::min<size_t>(cells_.size(), kMostCandidates));
    const MatrixXd near = (draws.colwise() - mean)(cells_, Eigen::all);
    covariance_ = near * near.transpose() / static_cast<double>(draws.cols());
    weight_.resize(std::ssize(cells_));
    information_.resize(std::ssize(cells_));
    for (Eigen::Index i = 0; i < weight_.size(); ++i) {
      const int c = cells_[static_cast<size_t>(i)];
      const double above = (draws.row(c).array() >= 0).cast<double>().mean();
      weight_[i] = std::min(above, 1 - above) / (deviation[c] * deviation[c]);
      const Eigen::ArrayXd p = (1 + (-(draws.row(c).array() + level)).exp()).inverse();
      information_[i] = std::max(1e-6, (p * (1 - p)).mean());
    }
  }

  // The cell whose trial reduces the doubt about all of them most, of those that had fewer than
  // `most`; from now on as if it had been run. Nothing where none had.
  std::optional<int> Take(const std::vector<int64_t>& run, int64_t most) {
    const VectorXd noise = information_.cwiseInverse();
    VectorXd gain =
        (covariance_.cwiseAbs2() * weight_).cwiseQuotient(covariance_.diagonal() + noise);
    for (Eigen::Index i = 0; i < gain.size(); ++i)
      if (run[static_cast<size_t>(cells_[static_cast<size_t>(i)])] >= most) gain[i] = 0;
    Eigen::Index best = 0;
    if (!(gain.maxCoeff(&best) > 0)) return std::nullopt;
    const VectorXd column = covariance_.col(best);
    covariance_.noalias() -= column * column.transpose() / (column[best] + noise[best]);
    return cells_[static_cast<size_t>(best)];
  }

 private:
  std::vector<int> cells_;
  MatrixXd covariance_;
  VectorXd weight_, information_;
};

}  // namespace

int Lattice::cells() const {
  int cells = 1;
  for (const LatticeAxis& axis : axes) cells *= axis.values;
  return cells;
}

int Lattice::Step(size_t axis) const {
  int step = 1;
  for (size_t k = axis + 1; k < axes.size(); ++k) step *= axes[k].values;
  return step;
}

std::vector<int> Lattice::At(int cell) const {
  std::vector<int> at(axes.size());
  for (size_t k = axes.size(); k-- > 0; cell /= axes[k].values) at[k] = cell % axes[k].values;
  return at;
}

Boundary BoundaryOf(const BoundarySearch& search, const std::vector<Tally>& tallies) {
  TD_CHECK(std::ssize(tallies) == search.lattice.cells(), "a tally for each cell");
  const double level = LogOdds(search.rate);
  const MatrixXd draws = DrawLogOdds(search.lattice, tallies, kDraws).array() - level;
  const VectorXd above = ShareAbove(draws);
  Boundary boundary{.sides = SidesOf(draws, above), .above = {above.begin(), above.end()}};
  boundary.undecided = ShareUndecided(boundary.sides);
  const MatrixXd odds = DrawLogOdds(search.lattice, tallies, kDraws, Variation::kMuch);
  std::vector<double> sorted(static_cast<size_t>(odds.cols()));
  const auto at = [&](double share) {
    const auto place = static_cast<size_t>(share * static_cast<double>(sorted.size() - 1));
    return 1 / (1 + std::exp(-sorted[place]));
  };
  for (Eigen::Index c = 0; c < odds.rows(); ++c) {
    VectorXd::Map(sorted.data(), odds.cols()) = odds.row(c);
    std::ranges::sort(sorted);
    boundary.rate.push_back(at(0.5));
    boundary.low.push_back(at(0.025));
    boundary.high.push_back(at(0.975));
  }
  for (Eigen::Index i = 0; i < draws.cols(); ++i) {
    std::vector<float>& draw = boundary.draws.emplace_back();
    for (Eigen::Index c = 0; c < draws.rows(); ++c) draw.push_back(static_cast<float>(draws(c, i)));
  }
  return boundary;
}

int64_t RoundAfter(const Lattice& lattice, int64_t trials) {
  constexpr int64_t kLeast = 8;
  return trials == 0 ? FirstRound(lattice) : std::max(kLeast, trials / 6);
}

std::vector<int> NextRound(const BoundarySearch& search, const std::vector<Tally>& tallies,
                           std::vector<int64_t> run) {
  const int64_t trials = std::accumulate(run.begin(), run.end(), int64_t{0});
  const int64_t count = std::min(RoundAfter(search.lattice, trials), search.most - trials);
  const int64_t first = FirstRound(search.lattice);
  std::vector<int> cells;
  if (trials == 0) {
    for (int64_t i = 0; i < count; ++i) cells.push_back(EvenCell(search.lattice, i));
    return cells;
  }
  if (count <= 0) return {};
  const double level = LogOdds(search.rate);
  const MatrixXd draws = DrawLogOdds(search.lattice, tallies, kDraws).array() - level;
  if (ShareUndecided(SidesOf(draws, ShareAbove(draws))) <= search.width) return {};
  Doubt doubt(draws, level);
  for (int64_t i = trials; i < trials + count; ++i) {
    const std::optional<int> cell = i % kCheckEvery == 0
                                        ? EvenCell(search.lattice, first + i / kCheckEvery)
                                        : doubt.Take(run, search.most_of_cell);
    if (!cell || run[static_cast<size_t>(*cell)] >= search.most_of_cell) continue;
    ++run[static_cast<size_t>(*cell)];
    cells.push_back(*cell);
  }
  return cells;
}

}  // namespace turbidock::search
