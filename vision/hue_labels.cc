#include "vision/hue_labels.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>

#include "sim/base/vector_clones.h"

namespace turbidock::vision {
namespace {

// Pixels that are worked on together: long enough to fill the widest vectors, short enough that
// dark runs between lit ones are skipped.
constexpr int kRun = 320;

// A run's channels apart, and the largest of them.
struct Planes {
  alignas(64) std::array<std::array<uint8_t, kRun>, 3> channel;
  alignas(64) std::array<uint8_t, kRun> high;
};

// Splits `count` pixels into planes, writes their chroma and returns the largest.
TURBIDOCK_VECTOR_CLONES
int Split(const uint8_t* __restrict rgb, int count, Planes* __restrict planes,
          uint8_t* __restrict chroma) {
  uint8_t* __restrict red = planes->channel[0].data();
  uint8_t* __restrict green = planes->channel[1].data();
  uint8_t* __restrict blue = planes->channel[2].data();
  uint8_t* __restrict highest = planes->high.data();
  uint8_t top = 0;
  for (int i = 0; i < count; ++i) {
    const uint8_t r = rgb[3 * i], g = rgb[3 * i + 1], b = rgb[3 * i + 2];
    const uint8_t high = std::max(r, std::max(g, b)), low = std::min(r, std::min(g, b));
    const auto c = static_cast<uint8_t>(high - low);
    red[i] = r, green[i] = g, blue[i] = b, highest[i] = high, chroma[i] = c;
    top = std::max(top, c);
  }
  return top;
}

// Multiplies the channels of `count` pixels with gains in 256ths.
void Multiply(const uint8_t* rgb, int count, const std::array<int, 3>& gain, uint8_t* balanced) {
  for (int i = 0; i < count; ++i)
    for (int c = 0; c < 3; ++c)
      balanced[3 * i + c] =
          static_cast<uint8_t>(std::min(255, (rgb[3 * i + c] * gain[c] + 128) >> 8));
}

struct Channels {
  const uint8_t *own, *next, *last, *high;
};
struct Bounds {
  int16_t low_numerator, low_denominator, high_numerator, high_denominator;
  uint8_t floor, bit;
};

// Sets `bit` in the labels of the pixels inside a window and returns their largest chroma, 0 when
// there is none.
TURBIDOCK_VECTOR_CLONES
int Match(const Channels& channels, const Bounds& bounds, int count,
          const uint8_t* __restrict chroma, uint8_t* __restrict labels) {
  const uint8_t* __restrict own = channels.own;
  const uint8_t* __restrict next = channels.next;
  const uint8_t* __restrict last = channels.last;
  const uint8_t* __restrict high = channels.high;
  const int16_t low_numerator = bounds.low_numerator, low_denominator = bounds.low_denominator;
  const int16_t high_numerator = bounds.high_numerator, high_denominator = bounds.high_denominator;
  const uint8_t floor = bounds.floor, bit = bounds.bit;
  uint8_t top = 0;
  for (int i = 0; i < count; ++i) {
    const auto difference = static_cast<int16_t>(next[i] - last[i]);
    const int16_t c = chroma[i];
    const auto from = static_cast<int16_t>(low_numerator * c);
    const auto to = static_cast<int16_t>(high_numerator * c);
    // masks: a choice between numbers would keep the compiler from using vectors
    const int16_t above = static_cast<int16_t>(low_denominator * difference) >= from ? -1 : 0;
    const int16_t below = static_cast<int16_t>(high_denominator * difference) <= to ? -1 : 0;
    const uint8_t largest = own[i] == high[i] ? 0xff : 0;
    const uint8_t coloured = chroma[i] >= floor ? 0xff : 0;
    const auto match =
        static_cast<uint8_t>(static_cast<uint8_t>(above & below) & largest & coloured);
    labels[i] = static_cast<uint8_t>(labels[i] | (match & bit));
    top = std::max(top, static_cast<uint8_t>(match & chroma[i]));
  }
  return top;
}

// Writes the lesser chroma of a pixel and the one before it where both have `bit`, else 0, and
// returns the largest.
TURBIDOCK_VECTOR_CLONES
int PairChroma(uint8_t bit, int count, const uint8_t* __restrict label,
               const uint8_t* __restrict chroma, uint8_t* __restrict pair_chroma) {
  uint8_t top = 0;
  for (int i = 0; i < count; ++i) {
    const uint8_t both = (label[i] & label[i - 1] & bit) != 0 ? 0xff : 0;
    const auto pair = static_cast<uint8_t>(both & std::min(chroma[i], chroma[i - 1]));
    pair_chroma[i] = pair;
    top = std::max(top, pair);
  }
  return top;
}

// Whether one of eight bytes may be above a limit: if not, none is. (Beyond 127, 127 is the limit.)
bool MayExceed(const uint8_t* bytes, int limit) {
  constexpr uint64_t kOnes = 0x0101010101010101u;
  uint64_t word;
  std::memcpy(&word, bytes, sizeof word);
  return ((word | (word + kOnes * (127u - std::min(limit, 127)))) & (kOnes * 128)) != 0;
}

// Takes `bit` from the labels of the pixels below the threshold.
TURBIDOCK_VECTOR_CLONES
void CloseGate(uint8_t threshold, uint8_t bit, int count, const uint8_t* __restrict chroma,
               uint8_t* __restrict labels) {
  const auto others = static_cast<uint8_t>(~bit);
  for (int i = 0; i < count; ++i)
    labels[i] = static_cast<uint8_t>(labels[i] & (chroma[i] >= threshold ? 0xff : others));
}

}  // namespace

void CheckHues(const MarkerParams& marker, const HueParams& hue) {
  const auto degrees = [](double rad) {
    return std::to_string(std::lround(rad * 180 / std::numbers::pi));
  };
  for (size_t i = 0; i < marker.balls.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      const BallParams &a = marker.balls[j], &b = marker.balls[i];
      const double apart_rad = std::abs(WrapAngle(a.hue_rad - b.hue_rad));
      if (apart_rad < hue.window_rad)
        throw ConfigError("marker.balls", "balls " + a.name + " and " + b.name +
                                              " cannot be told apart: their hues differ by " +
                                              degrees(apart_rad) + "°, less than the " +
                                              degrees(hue.window_rad) +
                                              " of estimator.hue.window_rad");
    }
}

int HueParams::OwnChromaPixels(int width_px, int height_px) const {
  return std::max(1, static_cast<int>(std::lround(own_chroma_image_share * width_px * height_px)));
}

HueLabeller::Fraction HueLabeller::NearestFraction(double x) {
  Fraction nearest;
  double least = 2;
  for (int denominator = 1; denominator < 128; ++denominator) {
    const double numerator = std::round(x * denominator);
    const double error = std::abs(numerator / denominator - x);
    if (error >= least) continue;
    least = error;
    nearest = {static_cast<int16_t>(numerator), static_cast<int16_t>(denominator)};
  }
  return nearest;
}

HueLabeller::HueLabeller(const HueParams& params, const MarkerParams& marker)
    : params_(params), ball_count_(static_cast<int>(marker.balls.size())) {
  CheckFields(params, "estimator.hue");
  CheckFields(marker, "marker");
  constexpr double kSextant_rad = std::numbers::pi / 3;
  for (int b = 0; b < ball_count_; ++b)
    for (int channel = 0; channel < 3; ++channel) {
      // Where the ball's hue is from the channel's own, in sextants; the channel is the largest
      // within one sextant to either side.
      const double from_channel = std::remainder(
          marker.balls[static_cast<size_t>(b)].hue_rad / kSextant_rad - 2 * channel, 6);
      const double half = params.window_rad / kSextant_rad;
      const double low = std::max(from_channel - half, -1.0);
      const double high = std::min(from_channel + half, 1.0);
      if (low <= high)
        windows_.push_back({b, channel, NearestFraction(low), NearestFraction(high)});
    }
}

// A channel of the median pixel is raised to 1 / kOwnRatio of the largest: what is nearer is the
// water's own (at most 1.2 in the path-traced pairs). Water below kLeastMedian_dn (guess: where a
// step is 6 %) tells nothing.
void HueLabeller::LearnCast(const Image3u8& rgb) {
  constexpr int kStep_px = 8, kLeastMedian_dn = 16;
  constexpr double kOwnRatio = 1.25;
  std::array<std::array<int, 256>, 3> count{};
  int pixels = 0;
  for (int v = kStep_px / 2; v < rgb.height(); v += kStep_px)
    for (int u = kStep_px / 2; u < rgb.width(); u += kStep_px, ++pixels)
      for (int c = 0; c < 3; ++c) ++count[c][rgb.at(u, v)[c]];
  std::array<int, 3> median{};
  for (int c = 0; c < 3; ++c)
    for (int below = count[c][0]; 2 * below < pixels; below += count[c][++median[c]]) {
    }
  const int top = *std::ranges::max_element(median);
  for (int c = 0; c < 3; ++c) {
    const double ratio = static_cast<double>(top) / std::max(1, median[c]);
    gain_[c] =
        top < kLeastMedian_dn
            ? kUnit
            : static_cast<int>(kUnit * std::clamp(ratio / kOwnRatio, 1.0, params_.most_cast_gain));
  }
}

std::array<double, 3> HueLabeller::cast_gain() const {
  std::array<double, 3> gain{};
  for (int c = 0; c < 3; ++c) gain[c] = static_cast<double>(gain_[c]) / kUnit;
  return gain;
}

// Adds the pairs of neighbours of the same hue of a run of a row that starts at `first`; begin >
// first looks one pixel back. They count with the lesser chroma: a lone pixel does not count.
void HueLabeller::CountPairs(const Image1u8& labels, int ball, int row, int first, int begin,
                             int end) {
  OwnChroma& own = own_[static_cast<size_t>(ball)];
  begin = std::max(begin, first + 1);
  constexpr int kWord = 8;  // few pairs count: most are passed by so many at a time
  std::array<uint8_t, kRun + kWord> pair_chroma;
  const int count = end - begin;
  const int top = PairChroma(static_cast<uint8_t>(1 << ball), count, labels.at(begin, row),
                             chroma_.at(begin, row), pair_chroma.data());
  if (top <= own.t) return;
  std::fill_n(pair_chroma.begin() + count, kWord, uint8_t{0});
  for (int word = 0; word < count; word += kWord) {
    const uint8_t* pairs = pair_chroma.data() + word;
    if (!MayExceed(pairs, own.t)) continue;
    for (int i = 0; i < kWord; ++i) {
      if (pairs[i] <= own.t) continue;
      ++own.pairs[pairs[i]];
      ++own.above;
    }
  }
  while (own.above >= own_chroma_pixels_) own.above -= own.pairs[static_cast<size_t>(++own.t)];
}

void HueLabeller::Label(const Image3u8& rgb, const PixelRegion& region, Image1u8* labels) {
  TD_CHECK(region.column_begin >= 0 && region.row_begin >= 0 && region.column_end <= rgb.width() &&
               region.row_end <= rgb.height(),
           "the region reaches over the image");
  labels->Resize(rgb.width(), rgb.height());
  if (chroma_.width() != rgb.width() || chroma_.height() != rgb.height()) {
    chroma_.Resize(rgb.width(), rgb.height());
    labelled_runs_.reserve(static_cast<size_t>(rgb.width() / kRun + 1) *
                           static_cast<size_t>(rgb.height()));
  }
  own_.fill({});
  own_chroma_pixels_ = params_.OwnChromaPixels(rgb.width(), rgb.height());
  labelled_runs_.clear();

  // of a part of an image the marker may be most
  if (region.column_begin == 0 && region.row_begin == 0 && region.column_end == rgb.width() &&
      region.row_end == rgb.height())
    LearnCast(rgb);
  const bool has_cast = gain_ != std::array{kUnit, kUnit, kUnit};

  Planes planes;
  std::array<uint8_t, 3 * kRun> balanced;
  for (int v = region.row_begin; v < region.row_end; ++v)
    for (int u = region.column_begin; u < region.column_end; u += kRun) {
      const int count = std::min(kRun, region.column_end - u);
      uint8_t* label = labels->at(u, v);
      const uint8_t* chroma = chroma_.at(u, v);
      std::memset(label, 0, static_cast<size_t>(count));
      const uint8_t* pixels = rgb.at(u, v);
      if (has_cast) {
        Multiply(pixels, count, gain_, balanced.data());
        pixels = balanced.data();
      }
      if (Split(pixels, count, &planes, chroma_.at(u, v)) < params_.chroma_floor_dn) continue;
      std::array<int, kMaxBalls> top{};
      int top_of_all = 0;
      for (const Window& window : windows_) {
        const auto own = static_cast<size_t>(window.channel);
        const int reached =
            Match({planes.channel[own].data(), planes.channel[(own + 1) % 3].data(),
                   planes.channel[(own + 2) % 3].data(), planes.high.data()},
                  {window.low.numerator, window.low.denominator, window.high.numerator,
                   window.high.denominator, static_cast<uint8_t>(params_.chroma_floor_dn),
                   static_cast<uint8_t>(1 << window.ball)},
                  count, chroma, label);
        int& top_of_ball = top[static_cast<size_t>(window.ball)];
        top_of_ball = std::max(top_of_ball, reached);
        top_of_all = std::max(top_of_all, reached);
      }
      if (top_of_all > 0) labelled_runs_.push_back(v * rgb.width() + u);
      for (int b = 0; b < ball_count_; ++b)
        if (top[static_cast<size_t>(b)] > own_[static_cast<size_t>(b)].t)
          CountPairs(*labels, b, v, region.column_begin, u, u + count);
    }

  for (int b = 0; b < ball_count_; ++b) {
    const auto i = static_cast<size_t>(b);
    threshold_dn_[i] =
        std::max(params_.chroma_floor_dn,
                 static_cast<int>(std::ceil(params_.own_chroma_fraction * own_[i].t)));
    if (threshold_dn_[i] == params_.chroma_floor_dn) continue;
    for (const int run : labelled_runs_)
      CloseGate(static_cast<uint8_t>(threshold_dn_[i]), static_cast<uint8_t>(1 << b),
                std::min(kRun, region.column_end - run % rgb.width()), chroma_.data() + run,
                labels->data() + run);
  }
}

}  // namespace turbidock::vision
