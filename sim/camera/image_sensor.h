#pragma once
// The cameras' electronics: radiance to 8-bit RGB.
//
//   x = gain w (n + sigma N) / full well,  n = full well L / full scale,  sigma^2 = read^2 [+ n]
//   DN = clip(round(255 f(min(x, white clip))), 0, 255)
// L is the radiance, n its electrons, w the channel's white balance, N a standard normal number, f
// the transfer curve, whose straight part goes on below zero. So noise stands before the gain and
// is amplified with the light. N depends on the camera's key, the frame, the place and the channel
// only. What composite video then does, where it is on: sim/camera/composite_video.h.

#include <cstdint>
#include <vector>

#include "sim/base/image.h"
#include "sim/base/row_noise.h"
#include "sim/camera/composite_video.h"
#include "sim/camera/exposure.h"
#include "sim/camera/sensor_params.h"
#include "sim/light/radiance.h"

namespace turbidock::camera {

class ImageSensor {
 public:
  // The keys of the two cameras' noise, drawn from streams of their own. `line_px` is the width of
  // the images, which a composite camera's blur is in proportion to.
  ImageSensor(const SensorParams& params, uint64_t left_key, uint64_t right_key,
              int line_px = CompositeVideo::kLine_px);

  // Allocates only when `out` does not have the size of the images.
  void Digitise(const light::RadianceStereo& radiance, int64_t frame, StereoImage* out) const;
  // A region of whole images; other pixels stay as they are.
  void Digitise(const light::RadianceStereo& radiance, const StereoRegion& region, int64_t frame,
                StereoImage* out) const;

  // Columns beside a region that its pixels depend on.
  int margin_px() const { return video_.margin_px(); }
  // From the next image on, instead of the parameters'.
  void Amplify(const Amplification& amplification);

  // A region of one camera. Radiance is read margin_px() further on both sides. `radiance` holds
  // whole rows from the region's first on, each its red values, then green and blue; `image` the
  // whole picture.
  void DigitiseRegion(Side side, int64_t frame, const PixelRegion& region, const float* radiance,
                      Image3u8* image) const;

  // The encoded value, 8-bit steps, that stands for a radiance before noise, rounding and clipping:
  // what Digitise computes, within 0.02 of the transfer curve.
  float SignalDn(float radiance) const;

 private:
  SensorParams params_;
  Stereo<uint64_t> keys_;
  CompositeVideo video_;
  // Rows under way, kept for their memory: an ImageSensor serves one thread at a time.
  mutable std::vector<float> split_, encoded_;
  mutable RowNoise noise_;  // made when it is first needed
};

}  // namespace turbidock::camera
