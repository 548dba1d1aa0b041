#pragma once
// The cameras' electronics, from radiance to 8 bits, as data.

#include <Eigen/Core>
#include <array>
#include <utility>

#include "sim/base/fields.h"

namespace turbidock::camera {

enum class TransferCurve {
  kSrgb,   // what screens and files expect
  kNtsc,   // composite video (SMPTE 170M): linear up to 8 % of full scale, then a power of 0.45
  kPower,  // the power given beside it, without a linear part
};
constexpr auto Names(TransferCurve) {
  using enum TransferCurve;
  return EnumList<TransferCurve>({{kSrgb, "srgb"}, {kNtsc, "ntsc"}, {kPower, "power"}});
}

// From radiance to 8 bits.
struct SensorParams {
  // Set so that a lit ball at 0.6 m in clear water is near 255 DN in the core, 150 to 200 at the
  // rim.
  double full_scale_radiance_w_m2_sr = 0.14;
  double gain = 1;        // with automatic exposure: the largest
  double auto_level = 0;  // see sim/camera/exposure.h; a guess where it is on
  double auto_time_s = 0.5;
  Eigen::Vector3d white_balance{1, 1, 1};
  TransferCurve transfer = TransferCurve::kSrgb;
  double power = 2.2;
  double read_noise_dn = 1.5;  // guess: 1 to 2 DN, twice that at night gain
  bool shot_noise = false;
  double full_well_electrons = 10000;
  // Gaussian (sigma) that colour differences go through along a row, after noise. NTSC gives them a
  // quarter of the brightness's bandwidth or less: 4 to 6 pixels of 640 from edge to edge.
  double chroma_blur_px = 0;

  static void Fields(auto& self, auto&& field) {
    field("full_scale_radiance_w_m2_sr", self.full_scale_radiance_w_m2_sr, Above(0),
          "radiance that gives 255 DN at gain 1");
    field("gain", self.gain, InRange(0.001, 1000), "factor before the transfer curve");
    field("auto_level", self.auto_level, InRange(0, 1),
          "share of full scale at which automatic exposure holds the images' mean; 0: fixed gain");
    field("auto_time_s", self.auto_time_s, InRange(0, 60), "time constant of automatic exposure");
    field("white_balance", self.white_balance, InRange(0.1, 10), "factor on each channel");
    field("transfer", self.transfer, Finite(), "curve from linear to encoded values");
    field("power", self.power, InRange(0.5, 5), "encoded = linear^(1/power), with transfer: power");
    field("read_noise_dn", self.read_noise_dn, InRange(0, 50),
          "standard deviation of the noise added to the encoded value");
    field("shot_noise", self.shot_noise, Finite(), "whether light itself is noisy");
    field("full_well_electrons", self.full_well_electrons, InRange(50, 1e7),
          "electrons at full scale and gain 1, for the shot noise");
    field("chroma_blur_px", self.chroma_blur_px, InRange(0, 16),
          "blur (sigma) of colour along rows of 640 pixels, as in composite video; 0: none");
  }
};

}  // namespace turbidock::camera
