#pragma once
// Radial distortion of the lenses, as a resampling of what pinhole cameras see. The estimator
// projects as a pinhole does: what is set here is what a calibration of its cameras left over.

#include <vector>

#include "sim/base/camera.h"
#include "sim/base/fields.h"
#include "sim/base/image.h"
#include "sim/light/radiance.h"

namespace turbidock::camera {

// Brown (1966): what a pinhole shows at distance r from the principal point, in focal lengths, is
// seen at r (1 + k1 r^2 + k2 r^4).
struct LensParams {
  double k1 = 0, k2 = 0;

  static void Fields(auto& self, auto&& field) {
    field("k1", self.k1, InRange(-1, 1),
          "coefficient k1 of the lenses' radial distortion, third order in r over the focal "
          "length; < 0 is a barrel");
    field(
        "k2", self.k2, InRange(-1, 1),
        "coefficient k2 of the lenses' radial distortion, fifth order in r over the focal length");
  }
};

// Both cameras' lenses.
class StereoLens {
 public:
  StereoLens() = default;  // none
  // ConfigError where the image would fold over before its corners: no light would be seen there.
  StereoLens(const LensParams& params, const StereoRig& rig);

  bool on() const { return !sources_.left.empty(); }
  // Interpolates between pixels; beyond a picture's edge it is as at the edge. Allocates only the
  // first time.
  void Distort(light::RadianceStereo* images);

  // Where a pinhole camera has what is seen at this distance, both in focal lengths.
  static double PinholeRadius(const LensParams& params, double seen_radius);

 private:
  struct Source {  // of a pixel: left upper pixel of four, and the way from there
    int index = 0;
    float u = 0, v = 0;
  };
  static std::vector<Source> Sources(const LensParams& params, const CameraIntrinsics& camera);

  Stereo<std::vector<Source>> sources_;
  Image3f seen_;
};

}  // namespace turbidock::camera
