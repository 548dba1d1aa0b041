#include "sim/camera/composite_video.h"

#include <algorithm>
#include <cmath>

#include "sim/base/vector_clones.h"
#include "sim/base/vector_math.h"

namespace turbidock::camera {
namespace {

// Brightness as in NTSC.
constexpr float kRedShare = 0.299f, kGreenShare = 0.587f, kBlueShare = 0.114f;

TURBIDOCK_VECTOR_CLONES
void ToDifferences(int count, const float* __restrict planes, int width, float* __restrict luma,
                   float* __restrict red, float* __restrict blue) {
  for (int i = 0; i < count; ++i) {
    const float r = planes[i], g = planes[width + i], b = planes[2 * width + i];
    const float y = kRedShare * r + kGreenShare * g + kBlueShare * b;
    luma[i] = y;
    red[i] = r - y;
    blue[i] = b - y;
  }
}

// out[i] = sum of kernel[|k|] in[i + k]; `in` reaches as far beyond both ends as the kernel.
// Several terms at once: what they add to stays in registers.
template <int kTerms, bool kFirst>
[[gnu::always_inline]] inline void AddTerms(const float* kernel, int first, int count,
                                            const float* __restrict in, float* __restrict out) {
  for (int i = 0; i < count; ++i) {
    float sum = kFirst ? kernel[0] * in[i] : out[i];
    for (int k = first; k < first + kTerms; ++k) sum += kernel[k] * (in[i - k] + in[i + k]);
    out[i] = sum;
  }
}

// The first terms in one pass, for which the compiler must know how many they are.
constexpr int kMostAtOnce = 8;

template <int kTerms = kMostAtOnce>
[[gnu::always_inline]] inline void AddFirstTerms(int terms, const float* kernel, int count,
                                                 const float* in, float* out) {
  if (terms >= kTerms) return AddTerms<kTerms, true>(kernel, 1, count, in, out);
  if constexpr (kTerms > 0) AddFirstTerms<kTerms - 1>(terms, kernel, count, in, out);
}

TURBIDOCK_VECTOR_CLONES
void Smooth(std::span<const float> kernel, int count, const float* in, float* out) {
  const int terms = static_cast<int>(kernel.size()) - 1;
  AddFirstTerms(terms, kernel.data(), count, in, out);
  for (int k = kMostAtOnce + 1; k <= terms; ++k)
    AddTerms<1, false>(kernel.data(), k, count, in, out);
}

// What becomes of pixels once their colour is blurred.
struct Line {
  float coring_dn, fade_dn, noise_dn;
  RowNoise::Row noise;  // from the first pixel's red on; other channels are `width` further
  int width;
};

// Coring, fading, back to red, green and blue, the line's noise, and rounding. `planes` as of
// ToBytes.
template <bool kFade>
[[gnu::always_inline]] inline void Decode(const Line& line, int count,
                                          const float* __restrict planes,
                                          const float* __restrict luma,
                                          const float* __restrict smooth_red,
                                          const float* __restrict smooth_blue,
                                          uint8_t* __restrict rgb) {
  constexpr float kNothing = 1e-6f;                              // no division by zero
  constexpr float kBlack_dn = CompositeVideo::kSetup_dn + 0.5f;  // half a step, for rounding
  // not through a reference, which the bytes might alias
  const auto [coring_dn, fade_dn, noise_dn, noise, width] = line;
  const float per_dn = 1 / fade_dn;
  for (int i = 0; i < count; ++i) {
    float red = smooth_red[i], blue = smooth_blue[i];
    const float length_dn = std::sqrt(red * red + blue * blue) + kNothing;
    float keep = std::max(0.0f, 1 - coring_dn / length_dn);
    if constexpr (kFade) {
      const float peak = std::max(planes[i], std::max(planes[width + i], planes[2 * width + i]));
      keep *= std::clamp((255 - peak) * per_dn, 0.0f, 1.0f);
    }
    red *= keep;
    blue *= keep;
    const float y = luma[i] + kBlack_dn;
    const float green = y - (kRedShare / kGreenShare * red + kBlueShare / kGreenShare * blue);
    rgb[3 * i] = ToByte(y + red + noise_dn * noise[i]);
    rgb[3 * i + 1] = ToByte(green + noise_dn * noise[width + i]);
    rgb[3 * i + 2] = ToByte(y + blue + noise_dn * noise[2 * width + i]);
  }
}

// Pixels from their brightness, their blurred colour and, where colour fades, their red, green and
// blue values as they were, `width` apart.
TURBIDOCK_VECTOR_CLONES
void ToBytes(const Line& line, int count, const float* planes, const float* luma, const float* red,
             const float* blue, uint8_t* rgb) {
  if (line.fade_dn > 0)
    Decode<true>(line, count, planes, luma, red, blue, rgb);
  else
    Decode<false>(line, count, planes, luma, red, blue, rgb);
}

// A Gaussian out to three sigma, from its middle on.
std::vector<float> HalfKernel(double sigma_px) {
  if (sigma_px <= 0) return {1};
  const int reach_px = std::max(1, static_cast<int>(std::lround(3 * sigma_px)));
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

void CompositeVideo::Transmit(std::span<const float> planes_dn, int begin, int end,
                              RowNoise::Row noise, uint8_t* rgb) const {
  const int margin = margin_px(), count = end - begin;
  const int width = static_cast<int>(planes_dn.size()) / 3;
  // what is there of what the pixels depend on
  const int first = std::max(begin - margin, 0), last = std::min(end + margin, width);
  const int padded = count + 2 * margin;
  // enough for any region of the row
  row_.resize(5 * static_cast<size_t>(width) + 6 * static_cast<size_t>(margin));
  float* luma = row_.data();
  float* red = luma + padded;
  float* blue = red + padded;
  const int before = first - (begin - margin), behind = last - (begin - margin);
  ToDifferences(last - first, planes_dn.data() + first, width, luma + before, red + before,
                blue + before);
  for (float* row : {red, blue}) {
    std::fill_n(row, before, row[before]);
    std::fill(row + behind, row + padded, row[behind - 1]);
  }
  float* smooth_red = blue + padded;
  float* smooth_blue = smooth_red + count;
  Smooth(kernel_, count, red + margin, smooth_red);
  Smooth(kernel_, count, blue + margin, smooth_blue);
  ToBytes({coring_dn_, fade_dn_, noise_dn_, noise.From(begin), width}, count,
          planes_dn.data() + begin, luma + margin, smooth_red, smooth_blue,
          rgb + 3 * static_cast<ptrdiff_t>(begin));
}

}  // namespace turbidock::camera
