#include "experiments/statistics/logistic.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <map>

#include "sim/base/check.h"

namespace turbidock::statistics {
namespace {

double Probability(double log_odds) { return 1 / (1 + std::exp(-log_odds)); }

// Counts by x, scaled to [0, 1], where the problem is well conditioned.
struct ScaledCounts {
  double low = 0, scale = 0;
  Eigen::MatrixX2d design;  // 1, x
  Eigen::ArrayXd successes, trials;
};

// Nothing where the values of x or the outcomes are all alike.
std::optional<ScaledCounts> Scaled(const std::vector<BinomialPoint>& points) {
  if (points.empty()) return std::nullopt;
  const auto [first, last] = std::ranges::minmax(points, {}, &BinomialPoint::x);
  // Of thousands of points, x to a thousandth of its range, which costs nothing and saves time.
  constexpr size_t kManyPoints = 4000;
  const double step = points.size() > kManyPoints ? (last.x - first.x) / 1000 : 0;
  std::map<double, Count> by_x;
  for (const BinomialPoint& point : points) {
    if (point.trials == 0) continue;
    const double x = step > 0 ? first.x + step * std::round((point.x - first.x) / step) : point.x;
    by_x[x].successes += point.successes;
    by_x[x].trials += point.trials;
  }
  if (by_x.size() < 2) return std::nullopt;
  const auto n = std::ssize(by_x);
  ScaledCounts counts{.low = by_x.begin()->first,
                      .scale = by_x.rbegin()->first - by_x.begin()->first,
                      .design = Eigen::MatrixX2d::Ones(n, 2),
                      .successes = Eigen::ArrayXd(n),
                      .trials = Eigen::ArrayXd(n)};
  Eigen::Index i = 0;
  for (const auto& [x, count] : by_x) {
    counts.design(i, 1) = (x - counts.low) / counts.scale;
    counts.successes(i) = static_cast<double>(count.successes);
    counts.trials(i++) = static_cast<double>(count.trials);
  }
  const double won = counts.successes.sum();
  if (won == 0 || won == counts.trials.sum()) return std::nullopt;
  return counts;
}

// The penalised likelihood at intercept and slope, its gradient, and the information.
struct Likelihood {
  Eigen::Vector2d beta, gradient;
  Eigen::Matrix2d information;
  double log = 0;
};

Likelihood LikelihoodAt(const ScaledCounts& counts, const Eigen::Vector2d& beta) {
  const Eigen::ArrayXd log_odds = counts.design * beta;
  const Eigen::ArrayXd p = log_odds.unaryExpr(&Probability), variance = p * (1 - p);
  const Eigen::Matrix2d information =
      counts.design.transpose() * (counts.trials * variance).matrix().asDiagonal() * counts.design;
  const Eigen::ArrayXd leverage =  // of one trial
      variance *
      (counts.design * information.inverse()).cwiseProduct(counts.design).rowwise().sum().array();
  const Eigen::ArrayXd log_of_rest =  // log(1 + exp(log_odds))
      log_odds.max(0) + (-log_odds.abs()).exp().log1p();
  return {.beta = beta,
          .gradient = counts.design.transpose() *
                      (counts.successes - counts.trials * (p + leverage * (p - 0.5))).matrix(),
          .information = information,
          .log = (counts.successes * log_odds - counts.trials * log_of_rest).sum() +
                 0.5 * std::log(information.determinant())};
}

// The largest, or of those with the slope that it starts from. Fisher's scoring, whose steps are
// shortened where they do not lead up, and where they go to and fro.
std::optional<Likelihood> LargestLikelihood(const ScaledCounts& counts,
                                            const Eigen::Vector2d& start, bool any_slope) {
  constexpr int kMaxSteps = 500;
  Likelihood best = LikelihoodAt(counts, start);
  Eigen::Vector2d last(0, 0);
  double share = 1;
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Vector2d change(best.gradient[0] / best.information(0, 0), 0);
    if (any_slope) change = best.information.inverse() * best.gradient;
    if (change.dot(last) < -0.3 * last.squaredNorm()) share /= 2;
    last = change;
    change *= share;
    const double least = 1e-10 * (1 + best.beta.norm());
    Likelihood next = LikelihoodAt(counts, best.beta + change);
    for (; !(next.log >= best.log) && change.norm() > least; change /= 2)
      next = LikelihoodAt(counts, best.beta + change / 2);
    if (!change.allFinite()) return std::nullopt;
    if (change.norm() <= least) return next.log >= best.log ? next : best;
    best = next;
  }
  return std::nullopt;
}

std::optional<Likelihood> LargestLikelihood(const ScaledCounts& counts) {
  const double won = counts.successes.sum(), lost = counts.trials.sum() - won;
  return LargestLikelihood(counts, {std::log((won + 0.5) / (lost + 0.5)), 0}, true);
}

// How many clusters there are, and how many times the slope's variance between them is what it
// would be if their trials did not depend on each other; at least 1.
struct Dependence {
  double clusters = std::numeric_limits<double>::infinity(), inflation = 1;
};

Dependence DependenceOf(std::span<const int64_t> clusters, const std::vector<BinomialPoint>& points,
                        const ScaledCounts& counts, const Likelihood& fit) {
  if (clusters.empty()) return {};
  TD_CHECK(clusters.size() == points.size(), "a cluster for each point");
  struct Part {
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  };
  std::map<int64_t, Part> parts;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d row(1, (points[i].x - counts.low) / counts.scale);
    const double p = Probability(row.dot(fit.beta)), n = static_cast<double>(points[i].trials);
    parts[clusters[i]].gradient += (static_cast<double>(points[i].successes) - n * p) * row;
    parts[clusters[i]].information += n * p * (1 - p) * row * row.transpose();
  }
  if (parts.size() == points.size()) return {};
  double variance = 0;  // the jackknife's: how the slope moves without each of them
  for (const auto& [cluster, part] : parts)
    variance += std::pow(((fit.information - part.information).inverse() * part.gradient)[1], 2);
  const auto n = static_cast<double>(parts.size());
  variance *= (n - 1) / n;
  return {n, std::max(1.0, variance / fit.information.inverse()(1, 1))};
}

}  // namespace

double LogisticFit::At(double x) const { return Probability(intercept + slope * x); }

std::optional<LogisticFit> FitLogistic(const std::vector<BinomialPoint>& points) {
  const auto counts = Scaled(points);
  const auto best = counts ? LargestLikelihood(*counts) : std::nullopt;
  if (!best || best->beta[1] == 0) return std::nullopt;
  const Eigen::Vector2d& beta = best->beta;
  const double half = -beta[0] / beta[1];
  if (half < 0 || half > 1) return std::nullopt;
  const Eigen::Vector2d gradient(-1 / beta[1], beta[0] / (beta[1] * beta[1]));
  const double z = boost::math::quantile(boost::math::normal(), 0.975);
  const double margin = z * std::sqrt(gradient.dot(best->information.inverse() * gradient));
  const double low = counts->low, scale = counts->scale;
  return LogisticFit{.intercept = beta[0] - beta[1] * low / scale,
                     .slope = beta[1] / scale,
                     .half_x = low + scale * half,
                     .half_low = low + scale * (half - margin),
                     .half_high = low + scale * (half + margin)};
}

std::optional<LogisticSlope> FitSlope(const std::vector<BinomialPoint>& points,
                                      std::span<const int64_t> clusters) {
  const auto counts = Scaled(points);
  const auto best = counts ? LargestLikelihood(*counts) : std::nullopt;
  if (!best) return std::nullopt;
  const Dependence dependence = DependenceOf(clusters, points, *counts, *best);
  if (dependence.clusters < 2) return std::nullopt;
  const boost::math::students_t t(dependence.clusters - 1);
  const double slope = best->beta[1], threshold = std::pow(boost::math::quantile(t, 0.975), 2);
  // What the likelihood loses with another slope, as the square of a deviation.
  const double middle =
      (counts->design.col(1).array() * counts->trials).sum() / counts->trials.sum();
  const auto loss = [&](double other) {
    const Eigen::Vector2d start(best->beta[0] + (slope - other) * middle, other);
    const auto fit = LargestLikelihood(*counts, start, false);
    return fit ? std::max(0.0, 2 * (best->log - fit->log)) / dependence.inflation : 0;
  };
  const auto end = [&](int direction) {
    double reach = direction * std::sqrt(best->information.inverse()(1, 1) * dependence.inflation);
    for (int doubled = 0; doubled < 30; ++doubled) {
      reach *= 2;
      const auto share =
          LeastReaching(threshold, [&](double u) { return loss(slope + u * reach); });
      if (share) return (slope + *share * reach) / counts->scale;
    }
    return direction * std::numeric_limits<double>::infinity();
  };
  return LogisticSlope{.slope = slope / counts->scale,
                       .low = end(-1),
                       .high = end(1),
                       .p = 2 * boost::math::cdf(t, -std::sqrt(loss(0)))};
}

}  // namespace turbidock::statistics
