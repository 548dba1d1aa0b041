#include "sim/light/forward_peak.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace turbidock::light {
namespace {

// Frequencies are in 1 / R. They end where a Gaussian takes them away whose blur is 1/35 of the
// radius within 4 radii, and of the distance beyond 16.
constexpr int kFrequencies = 2000;
constexpr double kHighest = 150, kCut = 50, kSmooth = 4;
constexpr double kStep = kHighest / kFrequencies;

// Hankel transform of a disc's radiance of unit intensity at the middles of the steps.
std::vector<double> Spectrum(const std::function<double(double)>& shape) {
  constexpr int kRings = 200;
  std::vector<double> spectrum(kFrequencies, 0.0);
  double total = 0;
  for (int i = 0; i < kRings; ++i) {
    const double r = (i + 0.5) / kRings, light = shape(r) * r;
    total += light;
    for (int j = 0; j < kFrequencies; ++j) spectrum[j] += light * j0((j + 0.5) * kStep * r);
  }
  for (double& value : spectrum) value /= total;
  return spectrum;
}

// h(x), and 1 at 0.
double MeanAlongWay(double x) { return x < 1e-6 ? 1 - x / 2 : -std::expm1(-x) / x; }

}  // namespace

SpreadBall::SpreadBall(const ForwardPeak& peak, double radius_m,
                       const std::function<double(double)>& shape)
    : profiles_(kDistances) {
  const std::vector<double> spectrum = Spectrum(shape);
  const auto spectrum_at = [&](double frequency) {
    const double x = std::max(0.0, frequency / kStep - 0.5);
    const int i = std::min(static_cast<int>(x), kFrequencies - 2);
    return spectrum[i] + (x - i) * (spectrum[i + 1] - spectrum[i]);
  };
  // of the frequencies in use: the source, and what the water at each distance spreads
  std::vector<double> source(kFrequencies);
  std::vector<std::array<double, kDistances>> spread(kFrequencies);
  double scale_before = 0;
  for (int place = 0; place < kPlaces - 1; ++place) {
    const double w = static_cast<double>(place) / (kPlaces - 1), r = w / (1 - w);
    // far from the ball nothing is sharp, and only low frequencies count
    const double scale = kSmooth / std::max(kSmooth, r), step = scale * kStep;
    if (scale != scale_before)
      for (int j = 0; j < kFrequencies; ++j) {
        const double frequency = (j + 0.5) * step;
        const double cut = frequency / (scale * kCut);
        source[j] = frequency * step * std::exp(-cut * cut) * spectrum_at(frequency);
        for (int k = 0; k < kDistances; ++k) {
          const double distance_m = kNear_m * std::exp2(static_cast<double>(k) / kPerOctave);
          const double turns = peak.scattering_per_m * distance_m;
          const double seen =
              turns * MeanAlongWay(peak.width_rad * distance_m / radius_m * frequency);
          spread[j][k] = std::exp(-turns) * std::expm1(seen);
        }
      }
    scale_before = scale;
    std::array<double, kDistances> sums{};
    for (int j = 0; j < kFrequencies; ++j) {
      const double wave = source[j] * j0((j + 0.5) * step * r);
      for (int k = 0; k < kDistances; ++k) sums[k] += wave * spread[j][k];
    }
    for (int k = 0; k < kDistances; ++k)
      profiles_[k][place] =
          static_cast<float>(std::max(0.0, sums[k]) / (2 * std::numbers::pi * radius_m * radius_m));
  }
  for (Profile& profile : profiles_) profile.back() = 0;
}

SpreadBall::Profile SpreadBall::At(double distance_m) const {
  const double x = std::clamp(kPerOctave * std::log2(std::max(distance_m, 1e-9) / kNear_m), 0.0,
                              kDistances - 1.0);
  const int k = std::min(static_cast<int>(x), kDistances - 2);
  const auto share = static_cast<float>(x - k);
  Profile profile;
  for (int i = 0; i < kPlaces; ++i)
    profile[i] = profiles_[k][i] + share * (profiles_[k + 1][i] - profiles_[k][i]);
  // nearer than the first node it falls with the distance
  const auto near = static_cast<float>(std::clamp(distance_m / kNear_m, 0.0, 1.0));
  for (float& value : profile) value *= near;
  return profile;
}

}  // namespace turbidock::light
