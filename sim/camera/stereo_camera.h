#pragma once
// Both cameras: from what they see (sim/view/rendered.h) to 8-bit images, through water and sensor.

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "sim/base/image.h"
#include "sim/base/random.h"
#include "sim/base/stage_timer.h"
#include "sim/camera/camera_params.h"
#include "sim/camera/exposure.h"
#include "sim/camera/image_sensor.h"
#include "sim/camera/lens.h"
#include "sim/camera/view_fault.h"
#include "sim/light/marine_snow.h"
#include "sim/light/radiance.h"
#include "sim/light/surfaces.h"
#include "sim/light/water.h"
#include "sim/view/rendered.h"

namespace turbidock::camera {

// Water and sensor at work on the same few rows, which stay in cache from one to the other. The
// images are those of Water::Apply and ImageSensor::Digitise.
class StereoCamera {
 public:
  // The cameras of a rig in front of these surfaces, with the lamps at X_HE (in the camera head).
  // `frame_s` between images. Noise and snow are drawn from the streams "camera.left",
  // "camera.right" and "snow".
  StereoCamera(const CameraParams& params, const StereoRig& rig,
               const light::SurfaceTable& surfaces, const std::vector<Pose>& X_HE, double frame_s,
               const SeedTree& seeds);
  // The same with the water made already.
  StereoCamera(const CameraParams& params, light::Water water, double frame_s,
               const SeedTree& seeds);
  // With distortion or a faulty port all of both views must be seen, with automatic exposure
  // when it meters: Seen says so.
  StereoCamera(light::Water water, ImageSensor sensor, const AutoExposure& exposure = {},
               light::MarineSnow snow = {}, StereoLens lens = {});

  // Exposes a region of the images, of which other pixels stay as they are: the same values as in
  // whole images. `rendered` holds at least what Seen(region, frame) says. Allocates only when
  // `out` does not have the size of the images. A timer gets kWater and kSensor.
  void Expose(const view::RenderedStereo& rendered, const StereoRegion& region, int64_t frame,
              StereoImage* out, StageTimer* timer = nullptr);
  // Whole images.
  void Expose(const view::RenderedStereo& rendered, int64_t frame, StereoImage* out) {
    Expose(rendered, whole(), frame, out);
  }

  // For a view that does not change: its light is computed once and exposed anew every frame.
  // Automatic exposure has settled on it. `rendered` must live as long as it is exposed.
  void Hold(const view::RenderedStereo& rendered);
  void ExposeHeld(const StereoRegion& region, int64_t frame, StereoImage* out);
  void ExposeHeld(int64_t frame, StereoImage* out) { ExposeHeld(whole(), frame, out); }

  // Looks through other water, at other lights or with another rig of the same size from here on;
  // surfaces and places of lamps are the same.
  // What is held is to be held anew.
  void SetWater(light::Water water) { water_ = std::move(water); }

  // Light from above in the images from here on (Water::SetDaylight).
  void SetDaylight(const Eigen::Array3d& irradiance_w_m2) { water_.SetDaylight(irradiance_w_m2); }
  // What is wrong with the ports and lenses from here on; not with what is held.
  void SetPortFaults(PortFaults faults) { port_ = std::move(faults); }

  StereoRegion whole() const { return water_.whole(); }
  // What must have been seen of a frame to expose a region.
  StereoRegion Seen(const StereoRegion& region, int64_t frame) const;

  const light::Water& water() const { return water_; }

 private:
  StereoRegion Lit(const StereoRegion& region) const;
  bool Meters(int64_t frame) const { return exposure_.on() && frame >= meters_next_; }
  bool PaintsWhole() const { return lens_.on() || port_.any(); }
  void ExposeSide(Side side, const PixelRegion& region, int64_t frame, StageTimer* timer,
                  Image3u8* out);

  light::Water water_;
  ImageSensor sensor_;
  AutoExposure exposure_;
  int64_t meters_next_ = std::numeric_limits<int64_t>::min();  // the frame
  light::MarineSnow snow_;
  StereoLens lens_;
  PortFaults port_;
  std::vector<float> band_;         // radiance of some rows
  light::RadianceStereo radiance_;  // of whole images, where bands do not do
  const view::RenderedStereo* held_view_ = nullptr;
  light::RadianceStereo held_;  // its light, without snow
};

}  // namespace turbidock::camera
