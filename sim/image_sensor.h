#pragma once
// The cameras' electronics: radiance to 8-bit RGB.
//
//   DN = clip(round(255 f(gain L / full_scale) + sigma n), 0, 255)
// f is the transfer curve, n a standard normal number and sigma^2 the read noise squared plus, with
// shot noise, (255 f')^2 x gain / electrons for a linear value x. The noise of a pixel depends on
// the camera's key, the frame, the place and the channel only.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/base/image.h"
#include "sim/optics_params.h"
#include "sim/water.h"

namespace turbidock::sim {

// Encoded value in [0, 1] of a linear one in [0, 1].
double Encode(const SensorParams& params, double linear);
double Decode(const SensorParams& params, double encoded);

class ImageSensor {
 public:
  // The keys of the two cameras' noise, drawn from streams of their own.
  ImageSensor(const SensorParams& params, uint64_t left_key, uint64_t right_key);

  // Allocates only when `out` does not have the size of the images.
  void Expose(const RadianceStereo& radiance, int64_t frame, StereoImage* out) const;

 private:
  // Encoded value and noise at a node of the linear scale.
  struct Response {
    float dn;
    float sigma_dn;
  };

  void ExposeView(const Image3f& radiance, uint64_t key, int64_t frame, Image3u8* out) const;

  float nodes_per_radiance_ = 0;
  float last_node_ = 0;
  std::vector<Response> response_;
  std::vector<float> normal_;  // quantiles of the normal distribution
  uint64_t left_key_ = 0, right_key_ = 0;
};

}  // namespace turbidock::sim
