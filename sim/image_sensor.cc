#include "sim/image_sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/base/check.h"
#include "sim/base/random.h"

namespace turbidock::sim {
namespace {

// The curve is followed by straight pieces of 1/2048 of full scale, up to 1.25 so that noise on a
// clipped value cannot bring it below 255. Against the sRGB curve that is within 0.03 DN; a power
// curve gets a straight toe (as real cameras have) that lies up to 2 DN below it within the first
// piece.
constexpr int kNodesAtFullScale = 2048;
constexpr int kNodes = kNodesAtFullScale * 5 / 4;

// Noise takes one of 2^12 normal quantiles: unit variance, ends at 3.7 standard deviations.
constexpr int kNormalBits = 12;

// Values that pass through the stack at a time.
constexpr int kBlock = 480;

// Quantile of the normal distribution by Newton's method on its distribution function.
double NormalQuantile(double probability, double start) {
  double z = start;
  for (int i = 0; i < 50; ++i) {
    const double error = 0.5 * std::erfc(-z / std::numbers::sqrt2) - probability;
    const double density = std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi);
    const double step = error / density;
    z -= step;
    if (std::abs(step) < 1e-12) break;
  }
  return z;
}

std::vector<float> NormalQuantiles() {
  constexpr int kCount = 1 << kNormalBits;
  std::vector<double> z(kCount);
  double last = 0, sum_of_squares = 0;
  // outwards from the median, each quantile starting at the one before
  for (int i = kCount / 2; i < kCount; ++i) {
    last = NormalQuantile((i + 0.5) / kCount, last);
    z[i] = last;
    z[kCount - 1 - i] = -last;
    sum_of_squares += 2 * last * last;
  }
  const double scale = 1 / std::sqrt(sum_of_squares / kCount);
  std::vector<float> quantiles(kCount);
  for (int i = 0; i < kCount; ++i) quantiles[i] = static_cast<float>(scale * z[i]);
  return quantiles;
}

// SplitMix64 (Steele, Lea, Flood 2014): 64 bits that pass BigCrush from a counter, in a few cycles.
inline uint64_t SplitMix(uint64_t key, uint64_t counter) {
  uint64_t x = key + counter * 0x9E3779B97F4A7C15u;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

}  // namespace

double Encode(const SensorParams& params, double linear) {
  if (params.transfer == TransferCurve::kPower) return std::pow(linear, 1 / params.power);
  // IEC 61966-2-1
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

double Decode(const SensorParams& params, double encoded) {
  if (params.transfer == TransferCurve::kPower) return std::pow(encoded, params.power);
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

ImageSensor::ImageSensor(const SensorParams& params, uint64_t left_key, uint64_t right_key)
    : normal_(NormalQuantiles()), left_key_(left_key), right_key_(right_key) {
  CheckFields(params, "sensor");
  nodes_per_radiance_ =
      static_cast<float>(params.gain * kNodesAtFullScale / params.full_scale_radiance_w_m2_sr);
  last_node_ = kNodes - 1;
  response_.resize(kNodes + 1);
  for (int i = 0; i <= kNodes; ++i) {
    const double linear = static_cast<double>(i) / kNodesAtFullScale;
    double variance_dn2 = params.read_noise_dn * params.read_noise_dn;
    if (params.shot_noise) {
      const double half = 0.5 / kNodesAtFullScale;
      const double low = std::max(0.0, linear - half);
      const double slope =
          255 * (Encode(params, linear + half) - Encode(params, low)) / (linear + half - low);
      variance_dn2 += slope * slope * linear * params.gain / params.full_well_electrons;
    }
    response_[i] = {static_cast<float>(255 * Encode(params, linear)),
                    static_cast<float>(std::sqrt(variance_dn2))};
  }
}

void ImageSensor::Expose(const RadianceStereo& radiance, int64_t frame, StereoImage* out) const {
  out->frame = frame;
  ExposeView(radiance.left, left_key_, frame, &out->left);
  ExposeView(radiance.right, right_key_, frame, &out->right);
}

void ImageSensor::ExposeView(const Image3f& radiance, uint64_t key, int64_t frame,
                             Image3u8* out) const {
  out->Resize(radiance.width(), radiance.height());
  const int values = 3 * radiance.width();
  const Response* response = response_.data();
  const float* normal = normal_.data();
  for (int v = 0; v < radiance.height(); ++v) {
    // every row counts from a place of its own
    const auto block = PhiloxBlock(key, static_cast<uint64_t>(frame), static_cast<uint64_t>(v));
    const uint64_t row_key = (static_cast<uint64_t>(block[0]) << 32) | block[1];
    const float* in = radiance.row(v);
    uint8_t* dn = out->row(v);
    for (int start = 0; start < values; start += kBlock) {
      const int count = std::min(kBlock, values - start);
      float noisy[kBlock];
      for (int i = 0; i < count; i += 4) {
        const uint64_t bits =
            SplitMix(row_key, static_cast<uint64_t>(start) + static_cast<uint64_t>(i));
        for (int j = i; j < std::min(i + 4, count); ++j) {
          // what is negative or no number counts as dark
          const float x = std::min(std::max(0.0f, in[start + j] * nodes_per_radiance_), last_node_);
          const int node = static_cast<int>(x);
          const Response& low = response[node];
          const float signal =
              low.dn + (x - static_cast<float>(node)) * (response[node + 1].dn - low.dn);
          const uint32_t draw = static_cast<uint32_t>(bits >> (16 * (j - i) + 16 - kNormalBits)) &
                                ((1u << kNormalBits) - 1);
          noisy[j] = signal + low.sigma_dn * normal[draw];
        }
      }
      // clipped with masks: half of the dark values are below zero, no branch could be predicted
      for (int i = 0; i < count; ++i) {
        // What this rounds wrongly is below zero, and clipped next.
        // NOLINTNEXTLINE(bugprone-incorrect-roundings)
        const int value = static_cast<int>(noisy[i] + 0.5f);
        const int positive = value & ~(value >> 31);
        dn[start + i] = static_cast<uint8_t>(positive | ((255 - positive) >> 31));
      }
    }
  }
}

}  // namespace turbidock::sim
