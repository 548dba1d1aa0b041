#include "sim/camera/composite_video.h"

#include <algorithm>
#include <cmath>

#include "sim/base/vector_clones.h"
#include "sim/light/vector_math.h"

namespace turbidock::camera {
namespace {

// Brightness as in NTSC.
constexpr float kRedShare = 0.299f, kGreenShare = 0.587f, kBlueShare = 0.114f;

TURBIDOCK_VECTOR_CLONES
void ToDifferences(int count, const float* __restrict rgb, float* __restrict luma,
                   float* __restrict red, float* __restrict blue, float* __restrict peak) {
  for (int i = 0; i < count; ++i) {
    const float r = rgb[3 * i], g = rgb[3 * i + 1], b = rgb[3 * i + 2];
    luma[i] = kRedShare * r + kGreenShare * g + kBlueShare * b;
    red[i] = r - luma[i];
    blue[i] = b - luma[i];
    peak[i] = std::max(r, std::max(g, b));
  }
}

// out[i] = sum of kernel[|k|] in[i + k]; `in` reaches as far beyond both ends as the kernel.
// Several terms at once: what they add to stays in registers.
template <int kTerms>
[[gnu::always_inline]] inline void AddTerms(const float* kernel, int first, int count,
                                            const float* __restrict in, float* __restrict out) {
  for (int i = 0; i < count; ++i) {
    float sum = out[i];
    for (int k = first; k < first + kTerms; ++k) sum += kernel[k] * (in[i - k] + in[i + k]);
    out[i] = sum;
  }
}

TURBIDOCK_VECTOR_CLONES
void Smooth(std::span<const float> kernel, int count, const float* in, float* out) {
  for (int i = 0; i < count; ++i) out[i] = kernel[0] * in[i];
  const int size = static_cast<int>(kernel.size());
  int k = 1;
  for (; k + 5 <= size; k += 5) AddTerms<5>(kernel.data(), k, count, in, out);
  for (; k < size; ++k) AddTerms<1>(kernel.data(), k, count, in, out);
}

TURBIDOCK_VECTOR_CLONES
void Core(float coring_dn, int count, float* __restrict red, float* __restrict blue) {
  constexpr float kNothing = 1e-6f;  // no division by zero
  for (int i = 0; i < count; ++i) {
    const float length_dn = std::sqrt(red[i] * red[i] + blue[i] * blue[i]) + kNothing;
    const float keep = std::max(0.0f, 1 - coring_dn / length_dn);
    red[i] *= keep;
    blue[i] *= keep;
  }
}

TURBIDOCK_VECTOR_CLONES
void Fade(float fade_dn, int count, const float* __restrict peak, float* __restrict red,
          float* __restrict blue) {
  constexpr float kFullScale_dn = 255.5f;  // with the half step that is in the values
  const float per_dn = 1 / fade_dn;
  for (int i = 0; i < count; ++i) {
    const float keep = std::clamp((kFullScale_dn - peak[i]) * per_dn, 0.0f, 1.0f);
    red[i] *= keep;
    blue[i] *= keep;
  }
}

// Interleaved, not yet whole numbers.
TURBIDOCK_VECTOR_CLONES
void FromDifferences(int count, const float* __restrict luma, const float* __restrict red,
                     const float* __restrict blue, float* __restrict rgb) {
  for (int i = 0; i < count; ++i) {
    const float y = luma[i] + CompositeVideo::kSetup_dn;
    rgb[3 * i] = y + red[i];
    rgb[3 * i + 1] = y - (kRedShare / kGreenShare * red[i] + kBlueShare / kGreenShare * blue[i]);
    rgb[3 * i + 2] = y + blue[i];
  }
}

struct LineNoise {
  float deviation_dn = 0;
  uint32_t key0 = 0, key1 = 0, first = 0;  // the first value's number in the row
};

TURBIDOCK_VECTOR_CLONES
void Digitise(int count, const float* __restrict value, const LineNoise& noise,
              uint8_t* __restrict dn) {
  const auto [deviation_dn, key0, key1, first] = noise;
  if (deviation_dn > 0)
    for (int i = 0; i < count; ++i)
      dn[i] = light::ToByte(value[i] +
                            deviation_dn * light::NormalFromBits(light::Mix(
                                               first + static_cast<uint32_t>(i), key0, key1)));
  else
    for (int i = 0; i < count; ++i) dn[i] = light::ToByte(value[i]);
}

// A Gaussian out to three sigma, from its middle on.
std::vector<float> HalfKernel(double sigma_px) {
  if (sigma_px <= 0) return {1};
  const int reach_px = static_cast<int>(std::ceil(3 * sigma_px));
  std::vector<double> half;
  double sum = 0;
  for (int k = 0; k <= reach_px; ++k) {
    half.push_back(std::exp(-0.5 * k * k / (sigma_px * sigma_px)));
    sum += k == 0 ? half[0] : 2 * half.back();
  }
  std::vector<float> kernel;
  kernel.reserve(half.size());
  for (const double value : half) kernel.push_back(static_cast<float>(value / sum));
  return kernel;
}

}  // namespace

CompositeVideo::CompositeVideo(const SensorParams& params, int line_px)
    : coring_dn_(static_cast<float>(params.chroma_coring_dn)),
      fade_dn_(static_cast<float>(255 * params.highlight_fade)),
      noise_dn_(static_cast<float>(params.video_noise_dn)) {
  if (params.chroma_blur_px > 0 || coring_dn_ > 0 || fade_dn_ > 0 || noise_dn_ > 0)
    kernel_ = HalfKernel(params.chroma_blur_px * line_px / kLine_px);
}

void CompositeVideo::Transmit(std::span<const float> rgb_dn, int begin, int end,
                              const std::array<uint32_t, 2>& key, uint8_t* rgb) const {
  const int margin = margin_px(), count = end - begin, width = static_cast<int>(rgb_dn.size()) / 3;
  // what is there of what the pixels depend on
  const int first = std::max(begin - margin, 0), last = std::min(end + margin, width);
  const int padded = count + 2 * margin;
  // enough for any region of the row
  row_.resize(9 * static_cast<size_t>(width) + 8 * static_cast<size_t>(margin));
  float* luma = row_.data();
  float* red = luma + padded;
  float* blue = red + padded;
  float* peak = blue + padded;
  const int before = first - (begin - margin), behind = last - (begin - margin);
  ToDifferences(last - first, rgb_dn.data() + 3 * static_cast<ptrdiff_t>(first), luma + before,
                red + before, blue + before, peak + before);
  for (float* row : {red, blue}) {
    std::fill_n(row, before, row[before]);
    std::fill(row + behind, row + padded, row[behind - 1]);
  }
  float* smooth_red = peak + padded;
  float* smooth_blue = smooth_red + count;
  Smooth(kernel_, count, red + margin, smooth_red);
  Smooth(kernel_, count, blue + margin, smooth_blue);
  if (coring_dn_ > 0) Core(coring_dn_, count, smooth_red, smooth_blue);
  if (fade_dn_ > 0) Fade(fade_dn_, count, peak + margin, smooth_red, smooth_blue);
  float* decoded = smooth_blue + count;
  FromDifferences(count, luma + margin, smooth_red, smooth_blue, decoded);
  Digitise(3 * count, decoded, {noise_dn_, key[0], key[1], static_cast<uint32_t>(3 * begin)},
           rgb + 3 * static_cast<ptrdiff_t>(begin));
}

}  // namespace turbidock::camera
