#include "experiments/search/boundary_model.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "sim/base/random.h"

namespace turbidock::search {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTrendDeviation = 20;  // of the plane's log odds over a whole range
constexpr double kLevelDeviation = 5;   // and in the middle
constexpr double kKept = 0.99;          // share of the process's variance that its basis keeps
constexpr int kMostWeights = 200;

// Of the process. The first of each make the roughest that is likely: Variation::kMuch.
constexpr std::array kLengths{0.3, 0.6, 1.2};          // as shares of the ranges
constexpr std::array kDeviations{2.5, 1.0, 0.4, 6.0};  // in log odds
constexpr double kHopeless = 12;                       // of log evidence below the best

// Products of eigenvectors along the axes, times the roots of their eigenvalues: the process of
// standard deviation 1 is this times independent standard normal weights.
MatrixXd ProcessBasis(const Lattice& lattice, double length) {
  std::vector<MatrixXd> vectors;
  std::vector<VectorXd> values;
  for (const LatticeAxis& axis : lattice.axes) {
    const int n = axis.values;
    MatrixXd kernel(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        kernel(i, j) = std::exp(-static_cast<double>(std::abs(i - j)) / (n - 1) / length);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(kernel);
    vectors.push_back(solver.eigenvectors());
    values.emplace_back(solver.eigenvalues().cwiseMax(0));
  }
  // Each column of the full basis by a number, as cells are.
  const int cells = lattice.cells();
  std::vector<double> product(static_cast<size_t>(cells), 1);
  std::vector<std::vector<int>> places;
  for (int cell = 0; cell < cells; ++cell) {
    places.push_back(lattice.At(cell));
    for (size_t k = 0; k < values.size(); ++k)
      product[static_cast<size_t>(cell)] *= values[k][places.back()[k]];
  }
  std::vector<int> order(product.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater(),
                           [&](int c) { return product[static_cast<size_t>(c)]; });
  double sum = 0;
  int kept = 0;
  while (kept < cells && kept < kMostWeights && sum < kKept * cells)
    sum += product[static_cast<size_t>(order[static_cast<size_t>(kept++)])];
  MatrixXd basis(cells, kept);
  for (int column = 0; column < kept; ++column) {
    const int of = order[static_cast<size_t>(column)];
    const std::vector<int>& numbers = places[static_cast<size_t>(of)];
    const double root = std::sqrt(product[static_cast<size_t>(of)]);
    for (int cell = 0; cell < cells; ++cell) {
      double value = root;
      for (size_t k = 0; k < vectors.size(); ++k)
        value *= vectors[k](places[static_cast<size_t>(cell)][k], numbers[k]);
      basis(cell, column) = value;
    }
  }
  return basis;
}

MatrixXd PlaneBasis(const Lattice& lattice) {
  MatrixXd basis(lattice.cells(), 1 + std::ssize(lattice.axes));
  for (int cell = 0; cell < lattice.cells(); ++cell) {
    const std::vector<int> at = lattice.At(cell);
    basis(cell, 0) = kLevelDeviation;
    for (size_t k = 0; k < at.size(); ++k)
      basis(cell, static_cast<Eigen::Index>(k) + 1) =
          kTrendDeviation * (static_cast<double>(at[k]) / (lattice.axes[k].values - 1) - 0.5);
  }
  return basis;
}

// The cells that have trials.
struct Data {
  std::vector<int> cells;
  VectorXd successes, trials;
};

Data DataOf(const std::vector<Tally>& tallies) {
  Data data;
  for (size_t i = 0; i < tallies.size(); ++i)
    if (tallies[i].trials > 0) data.cells.push_back(static_cast<int>(i));
  const auto n = std::ssize(data.cells);
  data.successes.resize(n);
  data.trials.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Tally& tally = tallies[static_cast<size_t>(data.cells[static_cast<size_t>(i)])];
    data.successes[i] = static_cast<double>(tally.successes);
    data.trials[i] = static_cast<double>(tally.trials);
  }
  return data;
}

double Softplus(double x) { return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x))); }

// The mode of the weights, the Cholesky factor of the curvature there, and the log evidence.
struct Laplace {
  VectorXd mode;
  Eigen::LLT<MatrixXd> curvature;
  double log_evidence = 0;
};

// `features`: of the cells with trials. Newton's method with halved steps, from `start`.
Laplace FitWeights(const MatrixXd& features, const Data& data, VectorXd start) {
  Laplace fit{.mode = std::move(start), .curvature = {}};
  const auto log_posterior = [&](const VectorXd& w, const VectorXd& odds) {
    double sum = -0.5 * w.squaredNorm();
    for (Eigen::Index i = 0; i < odds.size(); ++i)
      sum += data.successes[i] * odds[i] - data.trials[i] * Softplus(odds[i]);
    return sum;
  };
  constexpr int kMostSteps = 50;
  constexpr double kConverged = 1e-4;
  VectorXd odds = features * fit.mode;
  double value = log_posterior(fit.mode, odds);
  for (int step = 0; step < kMostSteps; ++step) {
    const VectorXd p = (1 + (-odds.array()).exp()).inverse();
    const VectorXd w = data.trials.array() * p.array() * (1 - p.array());
    const MatrixXd scaled = w.cwiseSqrt().asDiagonal() * features;
    MatrixXd hessian = MatrixXd::Identity(features.cols(), features.cols());
    hessian.selfadjointView<Eigen::Lower>().rankUpdate(scaled.transpose());
    fit.curvature.compute(hessian);
    const VectorXd residual = data.successes.array() - data.trials.array() * p.array();
    const VectorXd gradient = features.transpose() * residual - fit.mode;
    VectorXd change = fit.curvature.solve(gradient);
    const double gain = 0.5 * gradient.dot(change);
    if (gain < kConverged) break;
    for (int halvings = 0; halvings < 14; ++halvings) {
      const VectorXd moved = fit.mode + std::exp2(-halvings) * change;
      const VectorXd moved_odds = features * moved;
      const double moved_value = log_posterior(moved, moved_odds);
      if (moved_value < value) continue;
      fit.mode = moved, odds = moved_odds, value = moved_value;
      break;
    }
  }
  fit.log_evidence = value - fit.curvature.matrixL().toDenseMatrix().diagonal().array().log().sum();
  return fit;
}

struct Component {
  MatrixXd features;
  Laplace fit;
};

// Of every length, and of every deviation that is not out of the question; the first is the plane
// alone. With kMuch of the first length and deviation alone.
std::vector<Component> FitAll(const Lattice& lattice, const Data& data, Variation variation) {
  const MatrixXd plane = PlaneBasis(lattice);
  std::vector<Component> all;
  double most = -1e300;
  const auto add = [&](MatrixXd features, VectorXd start) {
    const MatrixXd at_data = features(data.cells, Eigen::all);
    Laplace fit = FitWeights(at_data, data, std::move(start));
    most = std::max(most, fit.log_evidence);
    all.push_back({std::move(features), std::move(fit)});
  };
  if (variation == Variation::kLearnt) add(plane, VectorXd::Zero(plane.cols()));
  for (const double length : kLengths) {
    const MatrixXd process = ProcessBasis(lattice, length);
    VectorXd start = VectorXd::Zero(plane.cols() + process.cols());
    for (const double deviation : kDeviations) {
      MatrixXd features(plane.rows(), start.size());
      features << plane, deviation * process;
      add(std::move(features), start);
      if (variation == Variation::kMuch) return all;
      if (all.back().fit.log_evidence < most - kHopeless) break;
      start = all.back().fit.mode;
    }
  }
  return all;
}

}  // namespace

MatrixXd DrawLogOdds(const Lattice& lattice, const std::vector<Tally>& tallies, int draws,
                     Variation variation) {
  const std::vector<Component> all = FitAll(lattice, DataOf(tallies), variation);
  double most = -1e300, sum = 0;
  for (const Component& c : all) most = std::max(most, c.fit.log_evidence);
  for (const Component& c : all) sum += std::exp(c.fit.log_evidence - most);
  MatrixXd odds(lattice.cells(), draws);
  Rng rng = SeedTree(0).Stream("boundary.draws");
  int begin = 0;
  double share = 0;
  for (const Component& c : all) {
    share += std::exp(c.fit.log_evidence - most) / sum;
    const int end = &c == &all.back() ? draws : static_cast<int>(std::lround(share * draws));
    if (end == begin) continue;
    MatrixXd weights =
        MatrixXd::NullaryExpr(c.features.cols(), end - begin, [&] { return rng.Normal(); });
    c.fit.curvature.matrixU().solveInPlace(weights);
    weights.colwise() += c.fit.mode;
    odds.middleCols(begin, end - begin).noalias() = c.features * weights;
    begin = end;
  }
  if (std::ranges::any_of(lattice.axes,
                          [](const LatticeAxis& axis) { return axis.trend != Trend::kUnknown; })) {
    const VectorXd mean = odds.rowwise().mean();
    const VectorXd known =
        (odds.colwise() - mean).rowwise().squaredNorm().cwiseMax(1e-9).cwiseInverse() * draws;
    for (int i = 0; i < draws; ++i) {
      VectorXd draw = odds.col(i);
      MakeMonotone(lattice, known, &draw);
      odds.col(i) = draw;
    }
  }
  return odds;
}

namespace {

// Pool adjacent violators: the nearest rising sequence to value[0], value[step], ...; `sign` -1:
// the nearest falling one. Sums are compared crosswise: a division for each pool takes most of the
// time.
void Pool(double* value, const double* weight, int count, int step, double sign) {
  struct Block {
    double sum, weight;
    int size;
  };
  static thread_local std::vector<Block> blocks;
  blocks.resize(static_cast<size_t>(count));
  size_t pools = 0;
  for (int i = 0; i < count; ++i) {
    const double of = weight[i * step];
    Block last = {sign * of * value[i * step], of, 1};
    for (; pools > 0; --pools) {
      const Block& before = blocks[pools - 1];
      if (!(before.sum * last.weight > last.sum * before.weight)) break;
      last = {before.sum + last.sum, before.weight + last.weight, before.size + last.size};
    }
    blocks[pools++] = last;
  }
  int i = 0;
  for (size_t pool = 0; pool < pools; ++pool) {
    const Block& block = blocks[pool];
    const double mean = sign * block.sum / block.weight;
    for (int k = 0; k < block.size; ++k, ++i)
      if (block.size > 1) value[step * i] = mean;
  }
}

void PoolAlong(const Lattice& lattice, size_t axis, const VectorXd& weights, VectorXd* values) {
  const int step = lattice.Step(axis), count = lattice.axes[axis].values;
  const double sign = lattice.axes[axis].trend == Trend::kRises ? 1 : -1;
  const auto cells = static_cast<int>(values->size());
  for (int first = 0; first < cells; first += step * count)
    for (int cell = first; cell < first + step; ++cell)
      Pool(values->data() + cell, weights.data() + cell, count, step, sign);
}

}  // namespace

void MakeMonotone(const Lattice& lattice, const VectorXd& weights, VectorXd* values) {
  std::vector<size_t> axes;
  for (size_t k = 0; k < lattice.axes.size(); ++k)
    if (lattice.axes[k].trend != Trend::kUnknown) axes.push_back(k);
  if (axes.size() == 1) return PoolAlong(lattice, axes[0], weights, values);
  constexpr int kMostRounds = 15;
  constexpr double kConverged = 0.03;  // of log odds
  std::vector<VectorXd> increments(axes.size(), VectorXd::Zero(values->size()));
  for (int round = 0; round < kMostRounds; ++round) {
    double change = 0;
    for (size_t k = 0; k < axes.size(); ++k) {
      const VectorXd target = *values - increments[k];
      VectorXd pooled = target;
      PoolAlong(lattice, axes[k], weights, &pooled);
      increments[k] = pooled - target;
      change = std::max(change, (pooled - *values).cwiseAbs().maxCoeff());
      *values = pooled;
    }
    if (change < kConverged) break;
  }
}

}  // namespace turbidock::search
