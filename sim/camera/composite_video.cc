#include "sim/camera/composite_video.h"

#include <algorithm>
#include <cmath>

#include "sim/base/vector_clones.h"
#include "sim/base/vector_math.h"

namespace turbidock::camera {
namespace {

// Brightness as in NTSC.
constexpr float kRedShare = 0.299f, kGreenShare = 0.587f, kBlueShare = 0.114f;

// Variance of what sampling by pairs and drawing lines between them blurs, pixels^2: two places
// half a pixel from their middle, then a triangle that reaches two pixels to either side (read at
// pixels' middles it has 3/4, so the blur is 1/12 pixels^2 wider than asked).
constexpr double kPairs_px2 = 0.25 + 2.0 / 3;

[[gnu::always_inline]] inline float LumaOf(float red, float green, float blue) {
  return kRedShare * red + kGreenShare * green + kBlueShare * blue;
}

// Mean differences of pairs of pixels and, with kFade, their largest value. `planes` begins with
// the first pair's red values; green and blue are `width` further.
template <bool kFade>
[[gnu::always_inline]] inline void AddPairs(int count, const float* __restrict planes, int width,
                                            float* __restrict red, float* __restrict blue,
                                            float* __restrict peak) {
  const float *green_dn = planes + width, *blue_dn = green_dn + width;
  for (int j = 0; j < count; ++j) {
    const float r = planes[2 * j] + planes[2 * j + 1];
    const float g = green_dn[2 * j] + green_dn[2 * j + 1];
    const float b = blue_dn[2 * j] + blue_dn[2 * j + 1];
    const float y = LumaOf(r, g, b);
    red[j] = 0.5f * (r - y);
    blue[j] = 0.5f * (b - y);
    if constexpr (kFade)
      peak[j] = std::max(std::max(std::max(planes[2 * j], planes[2 * j + 1]),
                                  std::max(green_dn[2 * j], green_dn[2 * j + 1])),
                         std::max(blue_dn[2 * j], blue_dn[2 * j + 1]));
  }
}

TURBIDOCK_VECTOR_CLONES
void ToPairs(bool fade, int count, const float* planes, int width, float* red, float* blue,
             float* peak) {
  if (fade)
    AddPairs<true>(count, planes, width, red, blue, peak);
  else
    AddPairs<false>(count, planes, width, red, blue, peak);
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

// What becomes of pairs once they are blurred: coring, fading, the line's noise.
struct PairRow {
  float coring_dn, fade_dn, noise_dn;
  RowNoise::Row red_noise, blue_noise;  // from the first pair on
};

template <bool kFade>
[[gnu::always_inline]] inline void Suppress(const PairRow& row, int count,
                                            const float* __restrict peak, float* __restrict red,
                                            float* __restrict blue) {
  constexpr float kNothing = 1e-6f;  // no division by zero
  const auto [coring_dn, fade_dn, noise_dn, red_noise, blue_noise] = row;
  const float per_dn = 1 / fade_dn;
  for (int j = 0; j < count; ++j) {
    const float length_dn = std::sqrt(red[j] * red[j] + blue[j] * blue[j]) + kNothing;
    float keep = std::max(0.0f, 1 - coring_dn / length_dn);
    if constexpr (kFade) keep *= std::clamp((255 - peak[j]) * per_dn, 0.0f, 1.0f);
    red[j] = keep * red[j] + noise_dn * red_noise[j];
    blue[j] = keep * blue[j] + noise_dn * blue_noise[j];
  }
}

TURBIDOCK_VECTOR_CLONES
void SuppressWeak(const PairRow& row, int count, const float* peak, float* red, float* blue) {
  if (row.fade_dn > 0)
    Suppress<true>(row, count, peak, red, blue);
  else
    Suppress<false>(row, count, peak, red, blue);
}

// Values of pixels from those of pairs, on straight lines between the pairs' middles. One more pair
// is read on either side.
TURBIDOCK_VECTOR_CLONES
void DrawLines(int pairs, const float* __restrict of_pair, float* __restrict of_pixel) {
  for (int j = 0; j < pairs; ++j) {
    const float middle = 0.75f * of_pair[j];
    of_pixel[2 * j] = middle + 0.25f * of_pair[j - 1];
    of_pixel[2 * j + 1] = middle + 0.25f * of_pair[j + 1];
  }
}

// Back to red, green and blue, with the noise of brightness, rounded. `planes` begins with the
// first pixel's red value.
TURBIDOCK_VECTOR_CLONES
void ToBytes(int count, const float* __restrict planes, int width, const float* __restrict red,
             const float* __restrict blue, RowNoise::Row noise, float noise_dn,
             uint8_t* __restrict rgb) {
  constexpr float kBlack_dn = CompositeVideo::kSetup_dn + 0.5f;  // half a step, for rounding
  for (int i = 0; i < count; ++i) {
    const float y = LumaOf(planes[i], planes[width + i], planes[2 * width + i]) + kBlack_dn +
                    noise_dn * noise[i];
    rgb[3 * i] = ToByte(y + red[i]);
    rgb[3 * i + 1] =
        ToByte(y - (kRedShare / kGreenShare * red[i] + kBlueShare / kGreenShare * blue[i]));
    rgb[3 * i + 2] = ToByte(y + blue[i]);
  }
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
  if (params.chroma_blur_px <= 0 && coring_dn_ <= 0 && fade_dn_ <= 0 && noise_dn_ <= 0) return;
  const double blur_px = params.chroma_blur_px * line_px / kLine_px;
  kernel_ = HalfKernel(std::sqrt(std::max(0.0, blur_px * blur_px - kPairs_px2)) / 2);
}

void CompositeVideo::Transmit(std::span<const float> planes_dn, int begin, int end,
                              RowNoise::Row noise, RowNoise::Row color_noise, uint8_t* rgb) const {
  const int width = static_cast<int>(planes_dn.size()) / 3, reach = reach_pairs();
  // pairs that lines are drawn from, one more on either side than there are pixels of
  const int first = begin / 2 - 1, pairs = (end + 1) / 2 + 1 - first;
  // and what they depend on, of which not all is there
  const int first_read = std::max(first - reach, 0);
  const int end_read = std::min(first + pairs + reach, width / 2);
  const int before = first_read - (first - reach), padded = pairs + 2 * reach;
  const int behind = before + end_read - first_read;
  // enough for any region of the row
  row_.resize(5 * (static_cast<size_t>(width) + 8) + 6 * static_cast<size_t>(reach));
  float* red = row_.data();
  float* blue = red + padded;
  float* peak = blue + padded;
  float* smooth_red = peak + padded;
  float* smooth_blue = smooth_red + pairs;
  float* red_px = smooth_blue + pairs;
  float* blue_px = red_px + 2 * static_cast<ptrdiff_t>(pairs);
  ToPairs(fade_dn_ > 0, end_read - first_read,
          planes_dn.data() + 2 * static_cast<ptrdiff_t>(first_read), width, red + before,
          blue + before, peak + before);
  for (float* row : {red, blue, peak}) {
    std::fill_n(row, before, row[before]);
    std::fill(row + behind, row + padded, row[behind - 1]);
  }
  Smooth(kernel_, pairs, red + reach, smooth_red);
  Smooth(kernel_, pairs, blue + reach, smooth_blue);
  // a row's numbers: of red's pairs, then of blue's, each from pair -1 on
  const RowNoise::Row red_noise = color_noise.From(1 + first);
  SuppressWeak({coring_dn_, fade_dn_, noise_dn_, red_noise, red_noise.From(width / 2 + 2)}, pairs,
               peak + reach, smooth_red, smooth_blue);
  DrawLines(pairs - 2, smooth_red + 1, red_px);
  DrawLines(pairs - 2, smooth_blue + 1, blue_px);
  const int odd = begin % 2;
  ToBytes(end - begin, planes_dn.data() + begin, width, red_px + odd, blue_px + odd,
          noise.From(begin), noise_dn_, rgb + 3 * static_cast<ptrdiff_t>(begin));
}

}  // namespace turbidock::camera
