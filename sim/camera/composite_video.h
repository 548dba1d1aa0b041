#pragma once
// What composite video does to colour, between the camera's curve and the digitiser's 8 bits.
//
// Colour travels as two differences, of red and of blue from the brightness, which are sampled at
// every other pixel, as digitisers do (ITU-R BT.601, 4:2:2). They are blurred along the row, by
// sampling alone as far as that is asked and by a Gaussian for the rest. Then,
// c being their length, each keeps max(0, 1 - coring / c) of itself, so that weak colour becomes
// grey: cameras take colour back in little light to hide grain (Sony SS-HQ1 application notes 10.8,
// Sharp LR38603 data sheet, "color level suppression"), decoders core it. Where a channel comes
// near full scale colour fades to white, as the sums that a camera with complementary filters
// computes it from are clipped (SS-HQ1 10.3.2). Line and digitiser add noise of their own to
// brightness and differences. Brightness stays sharp. Black is at 19 DN (7.5 % of the scale).

#include <cstdint>
#include <span>
#include <vector>

#include "sim/base/row_noise.h"
#include "sim/camera/sensor_params.h"

namespace turbidock::camera {

class CompositeVideo {
 public:
  static constexpr int kLine_px = 640;  // of the line that chroma_blur_px is of
  static constexpr int kSetup_dn = 19;  // what black is above zero

  // `line_px` is the width of the images, which the blur is in proportion to.
  CompositeVideo(const SensorParams& params, int line_px);

  // Off: a camera without it, whose pixels are rounded as they are.
  bool on() const { return !kernel_.empty(); }
  // Columns beside a pixel that it depends on.
  int margin_px() const { return on() ? 2 * reach_pairs() + 3 : 0; }

  // Columns [begin, end) of a row of 8-bit RGB from the whole row's unrounded red, green and blue
  // values, each together, of which margin_px() more on both sides are read. Colour that is not
  // there beyond the row's ends is as at the end. The noise depends on key and column only.
  void Transmit(std::span<const float> planes_dn, int begin, int end, RowNoise::Row noise,
                RowNoise::Row color_noise, uint8_t* rgb) const;

 private:
  int reach_pairs() const { return static_cast<int>(kernel_.size()) - 1; }

  // Of the blur, by pairs of pixels from its middle on; empty: off.
  std::vector<float> kernel_;
  float coring_dn_, fade_dn_, noise_dn_;
  // A row under way, kept for its memory: a CompositeVideo serves one thread at a time.
  mutable std::vector<float> row_;
};

}  // namespace turbidock::camera
