#include "sim/image_sensor.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "sim/base/check.h"
#include "sim/base/random.h"
#include "sim/base/vector_clones.h"
#include "sim/vector_math.h"

namespace turbidock::sim {
namespace {

// Linear values above this are taken as this: noise on a clipped value cannot bring it below 255.
constexpr float kMostLinear = 1.25f;

// Values that are exposed together: long enough to fill vectors, short enough that most of them are
// dark where the picture is.
constexpr int kRun = 192;

// Encoded = scale linear^exponent + offset, in DN, above the toe; slope linear below.
struct Curve {
  float linear_per_radiance;
  float exponent, scale_dn, offset_dn;
  float toe_end, toe_slope_dn;
};

Curve CurveOf(const SensorParams& params) {
  Curve curve{};
  curve.linear_per_radiance = static_cast<float>(params.gain / params.full_scale_radiance_w_m2_sr);
  if (params.transfer == TransferCurve::kPower) {
    curve.exponent = static_cast<float>(1 / params.power);
    curve.scale_dn = 255;
  } else {
    // IEC 61966-2-1
    curve.exponent = static_cast<float>(1 / 2.4);
    curve.scale_dn = static_cast<float>(255 * 1.055);
    curve.offset_dn = static_cast<float>(-255 * 0.055);
    curve.toe_end = 0.0031308f;
    curve.toe_slope_dn = static_cast<float>(255 * 12.92);
  }
  return curve;
}

// What is negative or no number counts as dark.
[[gnu::always_inline]] inline float LinearOf(const Curve& curve, float radiance) {
  const float x = radiance * curve.linear_per_radiance;
  const float lit = x > 0.0f ? x : 0.0f;
  // positive numbers are in the order of their bits, which are compared faster
  return std::bit_cast<float>(
      std::min(std::bit_cast<int32_t>(lit), std::bit_cast<int32_t>(kMostLinear)));
}

[[gnu::always_inline]] inline float PowerDn(const Curve& curve, float linear) {
  return curve.scale_dn * Exp2(curve.exponent * Log2(linear));
}

[[gnu::always_inline]] inline float EncodedDn(const Curve& curve, float linear, float power_dn) {
  return linear > curve.toe_end ? power_dn + curve.offset_dn : curve.toe_slope_dn * linear;
}

enum class Noise { kNone, kRead, kReadAndShot };

struct NoiseDn {
  float read_dn;
  float shot_linear;  // gain / electrons: variance of a linear value over itself
};

// Whether all values are on the curve's straight part. A negative one's bits are a negative number,
// too.
[[gnu::always_inline]] inline bool InToe(const Curve& curve, int count,
                                         const float* __restrict radiance) {
  int32_t most = 0;
  for (int i = 0; i < count; ++i) most = std::max(most, std::bit_cast<int32_t>(radiance[i]));
  const float x = std::bit_cast<float>(most) * curve.linear_per_radiance;
  return x <= curve.toe_end;
}

// With kToe, all values are on the curve's straight part: the same bits for less.
template <Noise kNoise, bool kToe>
[[gnu::always_inline]] inline void ExposeValues(const Curve curve, const NoiseDn noise,
                                                uint32_t key0, uint32_t key1, int begin, int end,
                                                const float* __restrict radiance,
                                                uint8_t* __restrict dn) {
  for (int i = begin; i < end; ++i) {
    const float linear = LinearOf(curve, radiance[i]);
    const float power_dn = kToe ? 0.0f : PowerDn(curve, linear);
    float value = (kToe ? curve.toe_slope_dn * linear : EncodedDn(curve, linear, power_dn)) + 0.5f;
    if constexpr (kNoise != Noise::kNone) {
      float sigma_dn = noise.read_dn;
      if constexpr (kNoise == Noise::kReadAndShot) {
        // f' x = exponent f above the toe, so (255 f')^2 x is this
        const float above = curve.exponent * power_dn;
        const float slope2_linear = !kToe && linear > curve.toe_end
                                        ? above * above / linear
                                        : curve.toe_slope_dn * curve.toe_slope_dn * linear;
        sigma_dn = std::sqrt(sigma_dn * sigma_dn + slope2_linear * noise.shot_linear);
      }
      value += sigma_dn * NormalFromBits(Mix(static_cast<uint32_t>(i), key0, key1));
    }
    // whole numbers are clamped by one instruction, other ones by two
    dn[i] = static_cast<uint8_t>(std::clamp(static_cast<int32_t>(value), 0, 255));
  }
}

template <Noise kNoise>
[[gnu::always_inline]] inline void ExposeRuns(const Curve& curve, const NoiseDn& noise,
                                              uint32_t key0, uint32_t key1, int begin, int end,
                                              const float* radiance, uint8_t* dn) {
  for (int run = begin; run < end; run += kRun) {
    const int run_end = std::min(run + kRun, end);
    if (InToe(curve, run_end - run, radiance + run))
      ExposeValues<kNoise, true>(curve, noise, key0, key1, run, run_end, radiance, dn);
    else
      ExposeValues<kNoise, false>(curve, noise, key0, key1, run, run_end, radiance, dn);
  }
}

TURBIDOCK_VECTOR_CLONES
void ExposeRow(const Curve& curve, const NoiseDn& noise, bool shot, uint32_t key0, uint32_t key1,
               int begin, int end, const float* radiance, uint8_t* dn) {
  if (shot)
    ExposeRuns<Noise::kReadAndShot>(curve, noise, key0, key1, begin, end, radiance, dn);
  else if (noise.read_dn > 0)
    ExposeRuns<Noise::kRead>(curve, noise, key0, key1, begin, end, radiance, dn);
  else
    ExposeRuns<Noise::kNone>(curve, noise, key0, key1, begin, end, radiance, dn);
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
    : params_(params), keys_{left_key, right_key} {
  CheckFields(params, "sensor");
}

void ImageSensor::Expose(const RadianceStereo& radiance, int64_t frame, StereoImage* out) const {
  out->frame = frame;
  const auto expose = [&](int view, const Image3f& in, Image3u8* image) {
    image->Resize(in.width(), in.height());
    ExposeRegion(view, frame, {0, 0, in.width(), in.height()}, in.data(), image);
  };
  expose(0, radiance.left, &out->left);
  expose(1, radiance.right, &out->right);
}

void ImageSensor::ExposeRegion(int view, int64_t frame, const PixelRegion& region,
                               const float* radiance, Image3u8* image) const {
  const Curve curve = CurveOf(params_);
  const NoiseDn noise = {static_cast<float>(params_.read_noise_dn),
                         static_cast<float>(params_.gain / params_.full_well_electrons)};
  for (int v = region.row_begin; v < region.row_end; ++v, radiance += 3 * image->width()) {
    // every row has a key of its own
    const auto key = PhiloxBlock(keys_[static_cast<size_t>(view)], static_cast<uint64_t>(frame),
                                 static_cast<uint64_t>(v));
    ExposeRow(curve, noise, params_.shot_noise, key[0], key[1], 3 * region.column_begin,
              3 * region.column_end, radiance, image->row(v));
  }
}

float ImageSensor::SignalDn(float radiance) const {
  const Curve curve = CurveOf(params_);
  const float linear = LinearOf(curve, radiance);
  return EncodedDn(curve, linear, PowerDn(curve, linear));
}

}  // namespace turbidock::sim
