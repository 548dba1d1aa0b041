#pragma once
// Which pixels agree with which ball's colour.
//
// A pixel agrees with a ball when its hue (of HSV, on the 8-bit values) is within the window of the
// ball's hue and its chroma, max(R, G, B) - min(R, G, B), is large enough in two ways: above a
// floor, below which noise makes hue meaningless, and above a fraction of the ball's own chroma in
// this image. The second is what tells a ball from surfaces it lights and from its halo, whose hue
// is the same. The ball's own chroma is estimated as the largest chroma that at least
// `own_chroma_image_share` of the image's pixels, of its hue, reach, each together with its
// neighbour on the left; so a few stray pixels do not set it, and it needs no knowledge of where
// the ball is.
//
// Before that a cast is taken out, as a white balance leaves it in green water: the water's own
// light is near grey, so where the median pixel of a whole image is not, its dim channels are
// raised.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/image.h"
#include "vision/marker_model.h"

namespace turbidock::vision {

struct HueParams {
  double window_rad = 0.4363;  // 25 degrees; published: 20 to 30, scale uncertain
  int chroma_floor_dn = 12;    // six times a noise of 2 DN: hue is then known to about 20 degrees
  // The least F at the true pose of eight path-traced pairs is 0.71; it is 0.59 with 0.3, where
  // boxes lit by a ball pass for it, and 0.63 with 0.46, where the rims of shaded balls drop out.
  double own_chroma_fraction = 0.4;
  // 40 pixels of 640 x 480: a quarter of a ball's disc at 1.6 m in the default rig, whatever the
  // number of its pixels
  double own_chroma_image_share = 1.3021e-4;
  double most_cast_gain = 2.5;  // guess: beyond it a channel has little but noise

  static void Fields(auto& self, auto&& field) {
    field("window_rad", self.window_rad, InRange(0.01, 1.5),
          "half width of the window of hues that agree with a ball's");
    field("chroma_floor_dn", self.chroma_floor_dn, InRange(1, 255),
          "least chroma of a pixel that agrees with a ball, in 8-bit steps");
    field("own_chroma_fraction", self.own_chroma_fraction, InRange(0, 1),
          "share of the ball's own chroma in the image that a pixel must reach to agree with it; "
          "0: hue and floor only");
    field("own_chroma_image_share", self.own_chroma_image_share, InRange(0, 1),
          "the ball's own chroma is the largest that this share of the image's pixels, of its hue, "
          "reaches");
    field("most_cast_gain", self.most_cast_gain, InRange(1, 10),
          "factor up to which a channel is raised to take a colour cast out of the image; 1: not "
          "at all");
  }

  // That share as a number of pixels.
  int OwnChromaPixels(int width_px, int height_px) const;
};

// ConfigError for two balls whose hues are within one window: a pixel of one agrees with both.
void CheckHues(const MarkerParams& marker, const HueParams& hue);

// Makes label images: bit b of a label says that the pixel agrees with ball b of the marker.
// Integer arithmetic only, the same bits on every machine. The edges of a hue window are held as
// fractions of a sextant with denominators up to 127: to 0.24 degrees at worst (0.01 in most
// places).
class HueLabeller {
 public:
  HueLabeller(const HueParams& params, const MarkerParams& marker);

  // Labels the pixels of `region` of one image, which must lie inside it; other labels stay as they
  // are. Both gates use these pixels alone; the cast is that of the last whole image. Allocates
  // only when the size of the image changes.
  void Label(const Image3u8& rgb, const PixelRegion& region, Image1u8* labels);
  void Label(const Image3u8& rgb, Image1u8* labels) {
    Label(rgb, {0, 0, rgb.width(), rgb.height()}, labels);
  }

  // What the channels are raised by, as the last whole image had it.
  std::array<double, 3> cast_gain() const;

  // Least chroma of a match with that ball in the image labelled last, 8-bit steps. The floor where
  // too few pixels have its hue.
  int threshold_dn(int ball) const { return threshold_dn_[static_cast<size_t>(ball)]; }

 private:
  static constexpr int kUnit = 256;
  // A fraction whose products with 8-bit numbers fit 16 bits.
  struct Fraction {
    int16_t numerator = 0, denominator = 1;
  };
  // One ball's window among the pixels whose largest channel is `channel` (0 R, 1 G, 2 B):
  // low <= (next channel - one after) / chroma <= high.
  struct Window {
    int ball = 0, channel = 0;
    Fraction low, high;
  };
  // The search for one ball's own chroma: the largest t that enough pixel pairs reach.
  struct OwnChroma {
    std::array<int, 256> pairs{};  // by their chroma, those above t
    int t = 0, above = 0;
  };
  static Fraction NearestFraction(double x);
  void LearnCast(const Image3u8& rgb);
  void CountPairs(const Image1u8& labels, int ball, int row, int first, int begin, int end);

  HueParams params_;
  int ball_count_;
  std::vector<Window> windows_;
  std::array<OwnChroma, kMaxBalls> own_{};
  int own_chroma_pixels_ = 1;                     // of the image labelled last
  std::array<int, 3> gain_{kUnit, kUnit, kUnit};  // of the channels, in 256ths
  std::array<int, kMaxBalls> threshold_dn_{};
  Image1u8 chroma_;
  std::vector<int> labelled_runs_;  // first pixels of the runs that hold a label
};

}  // namespace turbidock::vision
