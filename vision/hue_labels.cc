#include "vision/hue_labels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace turbidock::vision {

HueLabeller::HueLabeller(const HueParams& params, const MarkerParams& marker)
    : params_(params), ball_count_(static_cast<int>(marker.balls.size())) {
  CheckFields(params, "hue");
  CheckFields(marker, "marker");
  for (int step = 0; step <= kHueSteps; ++step) {
    const double hue_rad = 2 * std::numbers::pi * step / kHueSteps;
    for (size_t b = 0; b < marker.balls.size(); ++b) {
      const double apart_rad =
          std::abs(std::remainder(hue_rad - marker.balls[b].hue_rad, 2 * std::numbers::pi));
      if (apart_rad <= params.window_rad) balls_of_hue_[step] |= static_cast<uint8_t>(1u << b);
    }
  }
  for (int chroma = 1; chroma < 256; ++chroma) reciprocal_[chroma] = (1 << 24) / chroma;
}

void HueLabeller::Label(const Image3u8& rgb, Image1u8* labels) {
  labels->Resize(rgb.width(), rgb.height());
  chroma_.Resize(rgb.width(), rgb.height());
  for (int b = 0; b < ball_count_; ++b) histogram_[b].fill(0);

  // Hue windows and floor; chroma of what passes, by ball.
  const size_t pixels = rgb.pixels();
  unsigned last_agrees = 0;
  int last_chroma = 0;
  const uint8_t* in = rgb.data();
  for (size_t i = 0; i < pixels; ++i, in += 3) {
    const int r = in[0], g = in[1], b = in[2];
    const int high = std::max(r, std::max(g, b));
    const int chroma = high - std::min(r, std::min(g, b));
    uint8_t agrees = 0;
    if (chroma >= params_.chroma_floor_dn) {
      // Sextant arithmetic of HSV, in 1/256 sextants: red 0, green 512, blue 1024.
      int origin = 0, difference = g - b;
      if (high == g) origin = 512, difference = b - r;
      if (high == b) origin = 1024, difference = r - g;
      if (high == r) origin = 0, difference = g - b;
      int hue = origin + ((difference * reciprocal_[chroma] + (1 << 15)) >> 16);
      if (hue < 0) hue += kHueSteps;
      agrees = balls_of_hue_[hue];
      // The lesser chroma of two neighbours of the same hue: a lone pixel does not count.
      const int pair_chroma = std::min(chroma, last_chroma);
      for (unsigned rest = agrees & last_agrees; rest != 0; rest &= rest - 1)
        ++histogram_[static_cast<size_t>(std::countr_zero(rest))][pair_chroma];
    }
    last_agrees = agrees;
    last_chroma = chroma;
    labels->data()[i] = agrees;
    chroma_.data()[i] = static_cast<uint8_t>(chroma);
  }

  // Balls whose gate is open at each chroma.
  std::array<uint8_t, 256> open{};
  for (int b = 0; b < ball_count_; ++b) {
    int reached = 0, own_chroma = 256;
    while (own_chroma > 0 && reached < params_.own_chroma_pixels)
      reached += histogram_[b][--own_chroma];
    threshold_dn_[b] =
        std::max(params_.chroma_floor_dn,
                 static_cast<int>(std::ceil(params_.own_chroma_fraction * own_chroma)));
    for (int chroma = threshold_dn_[b]; chroma < 256; ++chroma)
      open[chroma] |= static_cast<uint8_t>(1u << b);
  }
  for (size_t i = 0; i < pixels; ++i) labels->data()[i] &= open[chroma_.data()[i]];
}

}  // namespace turbidock::vision
