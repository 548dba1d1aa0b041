#include "experiments/statistics/sampling.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::statistics {
namespace {

// The middle of one of 2^52 equal parts of (0, 1).
double OpenUnit(uint64_t bits) { return (static_cast<double>(bits >> 12) + 0.5) * 0x1.0p-52; }

}  // namespace

std::vector<double> IndependentSamples(int n, Rng* rng) {
  std::vector<double> samples(static_cast<size_t>(n));
  for (double& u : samples) u = OpenUnit(rng->NextU64());
  return samples;
}

std::vector<double> StratifiedSamples(int n, Rng* rng) {
  std::vector<double> parts(static_cast<size_t>(n));
  std::iota(parts.begin(), parts.end(), 0.0);
  for (size_t i = parts.size(); i > 1; --i)  // Fisher and Yates
    std::swap(parts[i - 1], parts[rng->Below(static_cast<uint32_t>(i))]);
  for (double& part : parts) part = (part + OpenUnit(rng->NextU64())) / n;
  return parts;
}

std::vector<double> SobolSamples(int n, int dimension, Rng* rng) {
  TD_CHECK(0 <= dimension && dimension < kMaxSobolDimensions, "a dimension of the sequence");
  const auto dimensions = static_cast<size_t>(dimension) + 1;
  boost::random::sobol sequence(dimensions);
  const uint64_t shift = rng->NextU64();
  std::vector<double> samples(static_cast<size_t>(n));
  // Boost leaves out the sequence's first point, the origin; without it the points are no net.
  if (n > 0) samples[0] = OpenUnit(shift);
  for (size_t i = 1; i < samples.size(); ++i) {
    sequence.discard(dimensions - 1);
    samples[i] = OpenUnit(sequence() ^ shift);
  }
  return samples;
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
