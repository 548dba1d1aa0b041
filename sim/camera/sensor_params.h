#pragma once
// The cameras' electronics, from radiance to 8 bits, as data.

#include <Eigen/Core>
#include <array>
#include <utility>

#include "sim/base/fields.h"

namespace turbidock::camera {

enum class TransferCurve {
  kLinear,  // a camera whose gamma is switched off, as for measuring
  kSrgb,    // what screens and files expect
  kNtsc,    // composite video (SMPTE 170M): linear up to 1.8 % of full scale, then a power of 0.45
  kPower,   // the power given beside it, without a linear part
};
constexpr auto Names(TransferCurve) {
  using enum TransferCurve;
  return EnumList<TransferCurve>(
      {{kLinear, "linear"}, {kSrgb, "srgb"}, {kNtsc, "ntsc"}, {kPower, "power"}});
}

// From radiance to 8 bits. The defaults are a digital camera's in good light; those of the
// published rig are in assets/optics.yaml.
struct SensorParams {
  // Set so that a lit ball at 0.6 m in clear water is near 255 DN in the core, 150 to 200 at the
  // rim.
  double full_scale_radiance_w_m2_sr = 0.14;
  double full_well_electrons = 10000;
  double read_noise_electrons = 5;  // 1.5 DN in the dark, with the sRGB curve
  bool shot_noise = false;
  double gain = 1;        // with automatic gain: the largest
  double auto_level = 0;  // see sim/camera/exposure.h; a guess where it is on
  double auto_time_s = 0.5;
  Eigen::Vector3d white_balance{1, 1, 1};
  double auto_white_balance_limit = 1;
  double white_clip = 1.1;  // 110 IRE, common of composite cameras; an 8-bit image ends at 1
  TransferCurve transfer = TransferCurve::kSrgb;
  double power = 2.2;
  // Gaussian (sigma) that colour differences go through along a row, after noise. NTSC gives them
  // 0.5 to 1.3 MHz (3 dB): 3.3 to 1.25 pixels of 640 in the 52 us of a line.
  double chroma_blur_px = 0;
  // See sim/camera/composite_video.h; any of these makes the camera a composite one.
  double chroma_coring_dn = 0;
  double highlight_fade = 0;
  double video_noise_dn = 0;

  // Whether two images of the same view differ.
  bool noisy() const { return read_noise_electrons > 0 || shot_noise || video_noise_dn > 0; }

  static void Fields(auto& self, auto&& field) {
    field("full_scale_radiance_w_m2_sr", self.full_scale_radiance_w_m2_sr, Above(0),
          "radiance that fills a pixel's well and gives 255 DN at gain 1");
    field("full_well_electrons", self.full_well_electrons, InRange(50, 1e7),
          "number of electrons of a pixel at full scale");
    field("read_noise_electrons", self.read_noise_electrons, InRange(0, 10000),
          "standard deviation of the sensor's noise before the gain, however dark, in electrons");
    field("shot_noise", self.shot_noise, Finite(),
          "whether the images have shot noise, that of light itself");
    field("gain", self.gain, InRange(0.001, 1000),
          "factor of the camera's gain on light and noise; with auto_level the largest one");
    field("auto_level", self.auto_level, InRange(0, 1),
          "share of full scale at which automatic gain holds the mean of what it meters; 0: fixed "
          "gain");
    field("auto_time_s", self.auto_time_s, InRange(0, 60),
          "time constant of automatic gain and white balance");
    field("white_balance", self.white_balance, InRange(0.1, 10),
          "factors of the white balance on the red, green and blue channel");
    field("auto_white_balance_limit", self.auto_white_balance_limit, InRange(1, 10),
          "factor up to which automatic white balance raises or lowers red and blue to make the "
          "images' mean grey; 1: fixed");
    field("white_clip", self.white_clip, InRange(1, 4),
          "share of full scale at which the amplifier clips, before colours are blurred");
    field("transfer", self.transfer, Finite(), "curve from linear to encoded pixel values");
    field("power", self.power, InRange(0.5, 5),
          "exponent of the curve if transfer is power: encoded = linear^(1/power)");
    field("chroma_blur_px", self.chroma_blur_px, InRange(0, 16),
          "composite video: blur (sigma) of colour along a row scaled to 640 pixels; at least 0.96 "
          "pixels of the image where any key of composite video is above 0");
    field("chroma_coring_dn", self.chroma_coring_dn, InRange(0, 100),
          "length of its colour differences that each pixel loses, in 8-bit steps: weaker colours "
          "become grey");
    field("highlight_fade", self.highlight_fade, InRange(0, 1),
          "share of full scale, just below it, over which colour fades to white; 0: colour stays");
    field("video_noise_dn", self.video_noise_dn, InRange(0, 50),
          "standard deviation of the noise of video line and digitiser, in 8-bit steps");
  }
};

}  // namespace turbidock::camera
