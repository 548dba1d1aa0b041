#include "sim/camera/image_sensor.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

#include "sim/base/check.h"
#include "sim/base/random.h"
#include "sim/base/vector_clones.h"
#include "sim/light/vector_math.h"

namespace turbidock::camera {
namespace {

// Light above this is taken as this: far above any white clip.
constexpr float kMaxLinear = 4.0f;

// Values that are encoded together: long enough to fill vectors, short enough that most of them are
// dark where the picture is.
constexpr int kRun = 192;

// Encoded = scale linear^exponent + offset, in DN, above the toe; slope linear below.
struct Curve {
  float linear_per_radiance;
  float white_clip;
  float exponent, scale_dn, offset_dn;
  float toe_end, toe_slope_dn;
};

Curve CurveOf(const SensorParams& params) {
  // scale linear^exponent + offset above the toe, slope linear below; 1 is full scale.
  const auto curve = [&](double exponent, double scale, double offset, double toe_end,
                         double toe_slope) -> Curve {
    return {
        .linear_per_radiance = static_cast<float>(params.gain / params.full_scale_radiance_w_m2_sr),
        .white_clip = static_cast<float>(params.white_clip),
        .exponent = static_cast<float>(exponent),
        .scale_dn = static_cast<float>(255 * scale),
        .offset_dn = static_cast<float>(255 * offset),
        .toe_end = static_cast<float>(toe_end),
        .toe_slope_dn = static_cast<float>(255 * toe_slope)};
  };
  switch (params.transfer) {
    case TransferCurve::kLinear:
      return curve(1, 1, 0, std::numeric_limits<float>::max(), 1);
    case TransferCurve::kPower:
      return curve(1 / params.power, 1, 0, 0, 0);
    case TransferCurve::kNtsc:
      return curve(0.45, 1.099, -0.099, 0.018, 4.5);  // SMPTE 170M
    case TransferCurve::kSrgb:
      return curve(1 / 2.4, 1.055, -0.055, 0.0031308, 12.92);  // IEC 61966-2-1
  }
  TD_CHECK(false, "unknown transfer curve");
}

// What is negative or no number counts as dark.
[[gnu::always_inline]] inline float LinearOf(const Curve& curve, float radiance) {
  const float x = radiance * curve.linear_per_radiance;
  const float lit = x > 0.0f ? x : 0.0f;
  // positive numbers are in the order of their bits, which are compared faster
  return std::bit_cast<float>(
      std::min(std::bit_cast<int32_t>(lit), std::bit_cast<int32_t>(kMaxLinear)));
}

// Of a value that may be negative.
template <bool kToe>
[[gnu::always_inline]] inline float EncodedDn(const Curve& curve, float linear) {
  const float straight_dn = curve.toe_slope_dn * linear;
  if constexpr (kToe) return straight_dn;
  // a logarithm is asked for whether it is used or not
  const float positive = std::max(linear, std::numeric_limits<float>::min());
  const float power_dn = curve.scale_dn * light::Exp2(curve.exponent * light::Log2(positive));
  return linear > curve.toe_end ? power_dn + curve.offset_dn : straight_dn;
}

enum class Noise { kNone, kRead, kReadAndShot };

// Of a linear value x: variance = read^2 + shot x.
struct LinearNoise {
  Noise kind = Noise::kNone;
  float read = 0, shot = 0;
};

LinearNoise NoiseOf(const SensorParams& params) {
  const double per_electron = params.gain / params.full_well_electrons;
  const double read = per_electron * params.read_noise_electrons;
  return {.kind = params.shot_noise ? Noise::kReadAndShot
                  : read > 0        ? Noise::kRead
                                    : Noise::kNone,
          .read = static_cast<float>(read),
          .shot = static_cast<float>(per_electron)};
}

[[gnu::always_inline]] inline float DeviationAt(const LinearNoise& noise, float linear) {
  return std::sqrt(noise.read * noise.read + noise.shot * linear);
}

// A row of one image: its keys, the white balance of each value (none: 1) and the values.
struct SensorRow {
  uint32_t key0, key1;
  const float* balance;
  const float* radiance;
};

// Whether all values are on the curve's straight part, noise and all. A negative one's bits are a
// negative number, too.
[[gnu::always_inline]] inline bool InToe(const Curve& curve, const LinearNoise& noise,
                                         const SensorRow& row, int begin, int end) {
  if (curve.toe_end >= curve.white_clip) return true;
  if (row.balance) return false;
  int32_t most = 0;
  for (int i = begin; i < end; ++i) most = std::max(most, std::bit_cast<int32_t>(row.radiance[i]));
  const float x = LinearOf(curve, std::bit_cast<float>(most));
  const float deviation = noise.kind == Noise::kReadAndShot ? DeviationAt(noise, x) : noise.read;
  return x + light::kMaxNormal * deviation <= curve.toe_end;
}

// DN as numbers of type T: rounded, or as they are. With kToe, all values are on the curve's
// straight part: the same bits for less.
template <Noise kNoise, bool kBalance, bool kToe, typename T>
[[gnu::always_inline]] inline void DigitiseValues(const Curve curve, const LinearNoise noise,
                                                  const SensorRow& row, int begin, int end,
                                                  T* __restrict dn) {
  const float* __restrict radiance = row.radiance;
  const float* __restrict balance = row.balance;
  const uint32_t key0 = row.key0, key1 = row.key1;
  for (int i = begin; i < end; ++i) {
    float linear = LinearOf(curve, radiance[i]);
    if constexpr (kNoise != Noise::kNone) {
      const float deviation =
          kNoise == Noise::kReadAndShot ? DeviationAt(noise, linear) : noise.read;
      linear += deviation * light::NormalFromBits(light::Mix(static_cast<uint32_t>(i), key0, key1));
    }
    if constexpr (kBalance) linear *= balance[i];
    linear = std::min(linear, curve.white_clip);
    const float value = EncodedDn<kToe>(curve, linear) + 0.5f;
    if constexpr (std::is_same_v<T, float>)
      dn[i] = value;
    else
      dn[i] = light::ToByte(value);
  }
}

template <Noise kNoise, bool kBalance, typename T>
[[gnu::always_inline]] inline void DigitiseRuns(const Curve& curve, const LinearNoise& noise,
                                                const SensorRow& row, int begin, int end, T* dn) {
  for (int run = begin; run < end; run += kRun) {
    const int run_end = std::min(run + kRun, end);
    if (InToe(curve, noise, row, run, run_end))
      DigitiseValues<kNoise, kBalance, true>(curve, noise, row, run, run_end, dn);
    else
      DigitiseValues<kNoise, kBalance, false>(curve, noise, row, run, run_end, dn);
  }
}

template <bool kBalance, typename T>
[[gnu::always_inline]] inline void DigitiseAnyRow(const Curve& curve, const LinearNoise& noise,
                                                  const SensorRow& row, int begin, int end, T* dn) {
  switch (noise.kind) {
    case Noise::kNone:
      return DigitiseRuns<Noise::kNone, kBalance>(curve, noise, row, begin, end, dn);
    case Noise::kRead:
      return DigitiseRuns<Noise::kRead, kBalance>(curve, noise, row, begin, end, dn);
    case Noise::kReadAndShot:
      return DigitiseRuns<Noise::kReadAndShot, kBalance>(curve, noise, row, begin, end, dn);
  }
}

TURBIDOCK_VECTOR_CLONES
void DigitiseRow(const Curve& curve, const LinearNoise& noise, const SensorRow& row, int begin,
                 int end, uint8_t* dn) {
  if (row.balance)
    DigitiseAnyRow<true>(curve, noise, row, begin, end, dn);
  else
    DigitiseAnyRow<false>(curve, noise, row, begin, end, dn);
}

// Half a step (for rounding) is in the values.
TURBIDOCK_VECTOR_CLONES
void DigitiseRowUnrounded(const Curve& curve, const LinearNoise& noise, const SensorRow& row,
                          int begin, int end, float* dn) {
  if (row.balance)
    DigitiseAnyRow<true>(curve, noise, row, begin, end, dn);
  else
    DigitiseAnyRow<false>(curve, noise, row, begin, end, dn);
}

}  // namespace

ImageSensor::ImageSensor(const SensorParams& params, uint64_t left_key, uint64_t right_key,
                         int line_px)
    : params_(params), keys_{left_key, right_key}, video_(params, line_px) {
  CheckFields(params, "sensor");
}

void ImageSensor::Amplify(const Amplification& amplification) {
  params_.gain = amplification.gain;
  params_.white_balance = amplification.white_balance;
  balance_.clear();
}

void ImageSensor::Digitise(const light::RadianceStereo& radiance, int64_t frame,
                           StereoImage* out) const {
  const StereoRegion whole = radiance.Each([](const Image3f& image) {
    return PixelRegion{0, 0, image.width(), image.height()};
  });
  Digitise(radiance, whole, frame, out);
}

void ImageSensor::Digitise(const light::RadianceStereo& radiance, const StereoRegion& region,
                           int64_t frame, StereoImage* out) const {
  out->frame = frame;
  for (const Side side : kSides) {
    const PixelRegion& part = region[side];
    const Image3f& in = radiance[side];
    (*out)[side].Resize(in.width(), in.height());
    if (!part.empty()) DigitiseRegion(side, frame, part, in.row(part.row_begin), &(*out)[side]);
  }
}

void ImageSensor::DigitiseRegion(Side side, int64_t frame, const PixelRegion& region,
                                 const float* radiance, Image3u8* image) const {
  const Curve curve = CurveOf(params_);
  const LinearNoise noise = NoiseOf(params_);
  const int width = image->width();
  // what the pixels depend on
  const int begin = std::max(region.column_begin - margin_px(), 0);
  const int end = std::min(region.column_end + margin_px(), width);
  const auto row_values = 3 * static_cast<size_t>(width);
  const bool balanced = params_.white_balance != Eigen::Vector3d::Ones();
  if (balanced && balance_.size() != row_values) {
    balance_.resize(row_values);
    for (size_t i = 0; i < row_values; ++i)
      balance_[i] = static_cast<float>(params_.white_balance[static_cast<int>(i % 3)]);
  }
  encoded_.resize(video_.on() ? row_values : 0);
  for (int v = region.row_begin; v < region.row_end; ++v, radiance += row_values) {
    // every row has a key of its own
    const auto key =
        PhiloxBlock(keys_[side], static_cast<uint64_t>(frame), static_cast<uint64_t>(v));
    const SensorRow row = {key[0], key[1], balanced ? balance_.data() : nullptr, radiance};
    if (!video_.on()) {
      DigitiseRow(curve, noise, row, 3 * begin, 3 * end, image->row(v));
    } else {
      DigitiseRowUnrounded(curve, noise, row, 3 * begin, 3 * end, encoded_.data());
      video_.Transmit(encoded_, region.column_begin, region.column_end, {key[2], key[3]},
                      image->row(v));
    }
  }
}

float ImageSensor::SignalDn(float radiance) const {
  const Curve curve = CurveOf(params_);
  return EncodedDn<false>(curve, std::min(LinearOf(curve, radiance), curve.white_clip));
}

}  // namespace turbidock::camera
