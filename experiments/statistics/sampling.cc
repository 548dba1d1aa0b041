#include "experiments/statistics/sampling.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

namespace turbidock::statistics {

// The middle of one of 2^52 equal parts of (0, 1).
double OpenUniform(Rng* rng) {
  return (static_cast<double>(rng->NextU64() >> 12) + 0.5) * 0x1.0p-52;
}

double UniformAt(double u, double low, double high) { return low + u * (high - low); }

double LogUniformAt(double u, double low, double high) {
  return std::clamp(low * std::exp(u * std::log(high / low)), low, high);
}

double NormalAt(double u, double mean, double deviation) {
  return boost::math::quantile(boost::math::normal(mean, deviation), u);
}

double NormalAt(double u, double mean, double deviation, double low, double high) {
  const boost::math::normal normal(mean, deviation);
  // In the upper tail a share close to 1 has no digits left: work from the side that is nearer.
  if (low > mean)
    return 2 * mean - NormalAt(1 - u, mean, deviation, 2 * mean - high, 2 * mean - low);
  const double below = boost::math::cdf(normal, low), above = boost::math::cdf(normal, high);
  return std::clamp(boost::math::quantile(normal, below + u * (above - below)), low, high);
}

}  // namespace turbidock::statistics
