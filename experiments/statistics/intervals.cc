#include "experiments/statistics/intervals.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::statistics {
namespace {

double TwoSidedZ(double confidence) {
  return boost::math::quantile(boost::math::normal(), (1 + confidence) / 2);
}

double Logistic(double x) { return 1 / (1 + std::exp(-x)); }

Count Sum(std::span<const Count> strata) {
  Count all;
  for (const Count& stratum : strata) {
    all.successes += stratum.successes;
    all.trials += stratum.trials;
  }
  return all;
}

}  // namespace

Interval WilsonInterval(int64_t successes, int64_t trials, double confidence) {
  return StratifiedInterval(std::array{Count{successes, trials}}, confidence);
}

double DesignEffect(std::span<const Count> strata) {
  const auto n = static_cast<double>(Sum(strata).trials);
  if (n == 0) return 1;
  double rate = 0, within = 0;
  for (const auto& [successes, trials] : strata) {
    const auto m = static_cast<double>(trials);
    const double p = (static_cast<double>(successes) + 0.5) / (m + 1);
    rate += m / n * p;
    within += m / n * p * (1 - p) * (m + 1) * (m + 1) / (m * m + m + 1);
  }
  return std::min(1.0, within / (rate * (1 - rate)));
}

Interval StratifiedInterval(std::span<const Count> strata, double confidence) {
  TD_CHECK(0 < confidence && confidence < 1, "a confidence in (0, 1)");
  for (const auto& [successes, trials] : strata)
    TD_CHECK(0 <= successes && successes <= trials, "no more successes than trials");
  const Count all = Sum(strata);
  if (all.trials == 0) return {};
  // Of these counts, as if there were so many trials.
  const auto trials = static_cast<double>(all.trials);
  const double n = trials / DesignEffect(strata);
  const double z = TwoSidedZ(confidence), p = static_cast<double>(all.successes) / trials;
  const double middle = (p + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z / (1 + z * z / n) * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  // At the ends the formula gives 0 and 1 but for rounding.
  return {all.successes == 0 ? 0 : std::max(0.0, middle - half),
          all.successes == all.trials ? 1 : std::min(1.0, middle + half)};
}

int64_t TrialsForHalfWidth(double half_width, double confidence) {
  TD_CHECK(0 < half_width && half_width <= 0.5, "a half width in (0, 1/2]");
  const double z = TwoSidedZ(confidence);
  return std::llround(std::ceil(z * z * (1 / (4 * half_width * half_width) - 1)));
}

std::optional<double> Quantile(std::vector<double> values, double share) {
  TD_CHECK(0 <= share && share <= 1, "a share in [0, 1]");
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  const double at = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(at);
  const size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
}

std::optional<Interval> MedianInterval(std::vector<double> values, double confidence) {
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  const boost::math::binomial below(static_cast<double>(values.size()), 0.5);
  // The least rank above the median with that probability, and the same from the other end.
  for (size_t k = values.size() / 2 + 1; k <= values.size(); ++k)
    if (boost::math::cdf(below, static_cast<double>(k - 1)) >= (1 + confidence) / 2)
      return Interval{values[values.size() - k], values[k - 1]};
  return std::nullopt;
}

std::optional<double> LeastReaching(double value, const std::function<double(double)>& function) {
  double low = 0, high = 1;
  if (function(high) < value) return std::nullopt;
  while (high - low > 1e-4) {
    const double middle = (low + high) / 2;
    (function(middle) >= value ? high : low) = middle;
  }
  return high;
}

double LogisticFit::At(double x) const { return Logistic(intercept + slope * x); }

std::optional<LogisticFit> FitLogistic(const std::vector<BinomialPoint>& points) {
  std::vector<BinomialPoint> run = points;
  std::erase_if(run, [](const BinomialPoint& point) { return point.trials == 0; });
  if (run.empty()) return std::nullopt;
  Eigen::ArrayXd x(std::ssize(run)), successes(x.size()), trials(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const BinomialPoint& point = run[static_cast<size_t>(i)];
    x(i) = point.x;
    successes(i) = static_cast<double>(point.successes);
    trials(i) = static_cast<double>(point.trials);
  }
  const double low = x.minCoeff(), scale = x.maxCoeff() - low;
  const double won = successes.sum(), lost = trials.sum() - won;
  if (!(scale > 0) || won == 0 || lost == 0) return std::nullopt;

  // Values of x scaled to [0, 1], where the problem is well conditioned.
  Eigen::MatrixX2d design(x.size(), 2);
  design << Eigen::ArrayXd::Ones(x.size()), (x - low) / scale;
  Eigen::Vector2d beta(std::log((won + 0.5) / (lost + 0.5)), 0);
  Eigen::Matrix2d covariance;
  constexpr int kMaxSteps = 200;
  bool converged = false;
  for (int step = 0; step < kMaxSteps && !converged; ++step) {
    const Eigen::ArrayXd p = (design * beta).unaryExpr(&Logistic), variance = p * (1 - p);
    covariance =
        (design.transpose() * (trials * variance).matrix().asDiagonal() * design).inverse();
    const Eigen::ArrayXd leverage =  // of one trial
        variance * (design * covariance).cwiseProduct(design).rowwise().sum().array();
    Eigen::Vector2d change = covariance * design.transpose() *
                             (successes - trials * p + trials * leverage * (0.5 - p)).matrix();
    const double largest = change.cwiseAbs().maxCoeff();
    if (!std::isfinite(largest)) return std::nullopt;
    if (largest > 2) change *= 2 / largest;
    beta += change;
    converged = largest < 1e-10;
  }
  if (!converged || beta[1] == 0) return std::nullopt;

  const double half = -beta[0] / beta[1];
  if (half < 0 || half > 1) return std::nullopt;
  const Eigen::Vector2d gradient(-1 / beta[1], beta[0] / (beta[1] * beta[1]));
  const double margin = TwoSidedZ(0.95) * std::sqrt(gradient.dot(covariance * gradient));
  return LogisticFit{.intercept = beta[0] - beta[1] * low / scale,
                     .slope = beta[1] / scale,
                     .half_x = low + scale * half,
                     .half_low = low + scale * (half - margin),
                     .half_high = low + scale * (half + margin)};
}

Separation SeparationOf(const std::vector<double>& a, const std::vector<double>& b,
                        double confidence) {
  TD_CHECK(!a.empty() && !b.empty(), "some of both kinds");
  std::vector<double> sorted = b;
  std::ranges::sort(sorted);
  double larger = 0;
  for (const double x : a) {
    const auto [first, last] = std::equal_range(sorted.begin(), sorted.end(), x);
    larger += static_cast<double>(first - sorted.begin()) + 0.5 * static_cast<double>(last - first);
  }
  const auto n = static_cast<double>(a.size()), m = static_cast<double>(b.size());
  const double p = larger / (n * m);
  // Of kinds that are told apart altogether, as if half a pair were not.
  const double q = std::clamp(p, 0.5 / (n * m), 1 - 0.5 / (n * m));
  const double variance =
      (q * (1 - q) + (n - 1) * (q / (2 - q) - q * q) + (m - 1) * (2 * q * q / (1 + q) - q * q)) /
      (n * m);
  const double logit = std::log(q / (1 - q));
  const double half = TwoSidedZ(confidence) * std::sqrt(variance) / (q * (1 - q));
  return {p, {Logistic(logit - half), Logistic(logit + half)}};
}

}  // namespace turbidock::statistics
