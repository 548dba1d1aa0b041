#include "sim/camera/image_sensor.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "sim/base/check.h"
#include "sim/base/random.h"
#include "sim/base/vector_clones.h"
#include "sim/base/vector_math.h"

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

// `amplification` is the gain and what a channel has of white balance.
Curve CurveOf(const SensorParams& params, double amplification) {
  // scale linear^exponent + offset above the toe, slope linear below; 1 is full scale.
  const auto curve = [&](double exponent, double scale, double offset, double toe_end,
                         double toe_slope) -> Curve {
    return {.linear_per_radiance =
                static_cast<float>(amplification / params.full_scale_radiance_w_m2_sr),
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
  const float power_dn = curve.scale_dn * Exp2(curve.exponent * Log2(positive));
  return linear > curve.toe_end ? power_dn + curve.offset_dn : straight_dn;
}

enum class Noise { kNone, kRead, kReadAndShot };

// Of a linear value x: variance = read^2 + shot x.
struct LinearNoise {
  Noise kind = Noise::kNone;
  float read = 0, shot = 0;
};

LinearNoise NoiseOf(const SensorParams& params, double amplification) {
  const double per_electron = amplification / params.full_well_electrons;
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

// A channel of a row of one image.
struct SensorRow {
  RowNoise::Row noise;
  const float* radiance;
};

// Whether all values are on the curve's straight part, noise and all. A negative one's bits are a
// negative number, too.
[[gnu::always_inline]] inline bool InToe(const Curve& curve, const LinearNoise& noise,
                                         const SensorRow& row, int begin, int end) {
  if (curve.toe_end >= curve.white_clip) return true;
  int32_t most = 0;
  for (int i = begin; i < end; ++i) most = std::max(most, std::bit_cast<int32_t>(row.radiance[i]));
  const float x = LinearOf(curve, std::bit_cast<float>(most));
  const float deviation = noise.kind == Noise::kReadAndShot ? DeviationAt(noise, x) : noise.read;
  return x + RowNoise::kMost * deviation <= curve.toe_end;
}

// DN, not rounded. With kToe, all of them are on the curve's straight part: the same bits for less.
template <Noise kNoise, bool kToe>
[[gnu::always_inline]] inline void DigitiseValues(const Curve curve, const LinearNoise noise,
                                                  const SensorRow row, int begin, int end,
                                                  float* __restrict dn) {
  for (int i = begin; i < end; ++i) {
    float linear = LinearOf(curve, row.radiance[i]);
    if constexpr (kNoise != Noise::kNone)
      linear +=
          row.noise[i] * (kNoise == Noise::kReadAndShot ? DeviationAt(noise, linear) : noise.read);
    dn[i] = EncodedDn<kToe>(curve, std::min(linear, curve.white_clip));
  }
}

template <Noise kNoise>
[[gnu::always_inline]] inline void DigitiseRuns(const Curve& curve, const LinearNoise& noise,
                                                const SensorRow& row, int begin, int end,
                                                float* dn) {
  // a curve that is straight all the way needs no runs
  const int length = curve.toe_end >= curve.white_clip ? end - begin : kRun;
  for (int run = begin; run < end; run += length) {
    const int run_end = std::min(run + length, end);
    if (InToe(curve, noise, row, run, run_end))
      DigitiseValues<kNoise, true>(curve, noise, row, run, run_end, dn);
    else
      DigitiseValues<kNoise, false>(curve, noise, row, run, run_end, dn);
  }
}

TURBIDOCK_VECTOR_CLONES
void DigitiseRow(const Curve& curve, const LinearNoise& noise, const SensorRow& row, int begin,
                 int end, float* dn) {
  switch (noise.kind) {
    case Noise::kNone:
      return DigitiseRuns<Noise::kNone>(curve, noise, row, begin, end, dn);
    case Noise::kRead:
      return DigitiseRuns<Noise::kRead>(curve, noise, row, begin, end, dn);
    case Noise::kReadAndShot:
      return DigitiseRuns<Noise::kReadAndShot>(curve, noise, row, begin, end, dn);
  }
}

TURBIDOCK_VECTOR_CLONES
void Interleave(int count, const float* __restrict red, const float* __restrict green,
                const float* __restrict blue, uint8_t* __restrict rgb) {
  for (int i = 0; i < count; ++i) {
    rgb[3 * i] = ToByte(red[i] + 0.5f);
    rgb[3 * i + 1] = ToByte(green[i] + 0.5f);
    rgb[3 * i + 2] = ToByte(blue[i] + 0.5f);
  }
}

}  // namespace

ImageSensor::ImageSensor(const SensorParams& params, uint64_t left_key, uint64_t right_key,
                         int line_px)
    : params_(params), keys_{left_key, right_key}, video_(params, line_px) {
  CheckFields(params, "cameras.sensor");
}

void ImageSensor::Amplify(const Amplification& amplification) {
  params_.gain = amplification.gain;
  params_.white_balance = amplification.white_balance;
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
    PixelRegion row = region[side];
    const Image3f& in = radiance[side];
    const int width = in.width();
    (*out)[side].Resize(width, in.height());
    if (row.empty()) continue;
    const int row_end = row.row_end;
    split_.resize(3 * static_cast<size_t>(width));
    for (int v = row.row_begin; v < row_end; ++v) {
      const float* rgb = in.row(v);
      float* value = split_.data();
      for (int k = 0; k < 3; ++k)
        for (int u = 0; u < width; ++u) *value++ = rgb[3 * u + k];
      row.row_begin = v;
      row.row_end = v + 1;
      DigitiseRegion(side, frame, row, split_.data(), &(*out)[side]);
    }
  }
}

void ImageSensor::DigitiseRegion(Side side, int64_t frame, const PixelRegion& region,
                                 const float* radiance, Image3u8* image) const {
  const int width = image->width();
  // what the pixels depend on
  const int begin = std::max(region.column_begin - margin_px(), 0);
  const int end = std::min(region.column_end + margin_px(), width);
  encoded_.resize(3 * static_cast<size_t>(width));
  if (noise_.row_values() < 3 * width) noise_ = RowNoise(3 * width);
  std::array<Curve, 3> curves;
  std::array<LinearNoise, 3> noise;
  for (int k = 0; k < 3; ++k) {
    const double amplification = params_.gain * params_.white_balance[k];
    curves[k] = CurveOf(params_, amplification);
    noise[k] = NoiseOf(params_, amplification);
  }
  for (int v = region.row_begin; v < region.row_end; ++v) {
    // every row has a key of its own
    const auto key =
        PhiloxBlock(keys_[side], static_cast<uint64_t>(frame), static_cast<uint64_t>(v));
    const RowNoise::Row of_sensor = noise_.Of(key[0]), of_line = noise_.Of(key[1]);
    for (int k = 0; k < 3; ++k, radiance += width)
      DigitiseRow(curves[k], noise[k], {of_sensor.From(k * width), radiance}, begin, end,
                  encoded_.data() + static_cast<ptrdiff_t>(k) * width);
    if (video_.on()) {
      video_.Transmit(encoded_, region.column_begin, region.column_end, of_line, noise_.Of(key[2]),
                      image->row(v));
    } else {
      const float* red = encoded_.data() + begin;
      Interleave(end - begin, red, red + width, red + 2 * width, image->at(begin, v));
    }
  }
}

float ImageSensor::SignalDn(float radiance) const {
  const Curve curve = CurveOf(params_, params_.gain);
  return EncodedDn<false>(curve, std::min(LinearOf(curve, radiance), curve.white_clip));
}

}  // namespace turbidock::camera
