#pragma once
// Both cameras: from what they see (sim/rendered.h) to 8-bit images, through water and sensor.

#include <cstdint>
#include <vector>

#include "sim/base/image.h"
#include "sim/base/stage_timer.h"
#include "sim/image_sensor.h"
#include "sim/rendered.h"
#include "sim/water.h"

namespace turbidock::sim {

// Water and sensor at work on the same few rows, which stay in cache from one to the other. The
// images are those of Water::Apply and ImageSensor::Expose.
class StereoCamera {
 public:
  StereoCamera(Water water, ImageSensor sensor);

  // Allocates only when `out` does not have the size of the images. A timer gets kWater and
  // kSensor.
  void Expose(const RenderedStereo& rendered, int64_t frame, StereoImage* out,
              StageTimer* timer = nullptr);

  const Water& water() const { return water_; }

 private:
  void ExposeView(int view, int64_t frame, const Image1u16& seen, StageTimer* timer, Image3u8* out);

  Water water_;
  ImageSensor sensor_;
  std::vector<float> band_;  // radiance of some rows
};

}  // namespace turbidock::sim
