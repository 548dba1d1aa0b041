#pragma once
// Marine snow: suspended particles large enough to be seen one by one, in the light of the lamps
// and of the lit balls.
//
// The particles fill space: a cube of random places that repeats itself. They drift with the
// current (RenderedStereo::drift_m), not with the waves, and sink. A particle scatters alike in all
// directions, so that its intensity is albedo E R^2 / 4 for the irradiance E of lamps and balls.
// Left out: spreading by the forward peak, daylight, particles out of focus, what a particle hides.

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/fields.h"
#include "sim/base/image.h"
#include "sim/base/pose.h"
#include "sim/light/radiance.h"
#include "sim/view/rendered.h"

namespace turbidock::light {

class Water;

struct SnowParams {
  // 2 to 28 aggregates a litre in the upper 20 m of Monterey Bay (Trent, Shanks & Silver 1978); the
  // sea scenarios take the least.
  double particles_per_m3 = 0;
  // Marine snow is larger than 0.5 mm and sinks some 50 to 100 m a day (Alldredge & Silver 1988).
  double diameter_m = 0.001;
  double sink_mps = 0.001;
  double albedo = 0.3;  // a guess

  static void Fields(auto& self, auto&& field) {
    field("particles_per_m3", self.particles_per_m3, InRange(0, 20000),
          "number of particles of marine snow in a cubic metre of water; 0: none");
    field("diameter_m", self.diameter_m, InRange(1e-4, 0.02),
          "diameter of a particle of marine snow");
    field("sink_mps", self.sink_mps, InRange(0, 0.1), "speed at which marine snow sinks");
    field("albedo", self.albedo, InRange(0, 1),
          "share of light that a particle of marine snow throws back");
  }
};

class MarineSnow {
 public:
  MarineSnow() = default;  // none
  // `frame_s` between images; places are drawn from the key.
  MarineSnow(const SnowParams& params, double frame_s, uint64_t key);

  bool on() const { return !x_WF_m_.empty(); }
  // Finds the particles that either camera sees in a region of their images at a frame, and the
  // light on them. `water` has been prepared for `seen`, which lives until they are painted and of
  // which only depths in the region are looked at.
  void Fall(const view::RenderedStereo& seen, const StereoRegion& region, int64_t frame,
            Water* water);
  // Adds their light to rows of one camera, laid out as by Water::PaintRows, or to both images.
  // Pixels in the region are the same whatever the region; others stay as they are.
  void PaintRows(Side side, int row_begin, int row_end, float* rgb);
  void Paint(RadianceStereo* images);

 private:
  // A particle in a band of an image: its light is a Gaussian about a place, cut off at so many
  // pixels from the one it is in.
  struct Speck {
    float u_px = 0, v_px = 0, sigma_px = 0, depth_m = 0;
    int column = 0, row = 0, reach_px = 0;
    Eigen::Array3f radiance_w_m2_sr = Eigen::Array3f::Zero();  // the sum over all pixels
    int next = -1;                                             // in the same band; -1: none
  };
  struct Specks {
    std::vector<Speck> all;
    std::vector<int> first_of_band;
  };
  // Rows of pixels wherever they are: a value lies at first + the steps to it.
  struct Rows {
    float* first;
    ptrdiff_t per_row, per_column, per_channel;
    int begin, end;
  };

  // How far the particles have gone.
  void Gather(const Pose& X_WH, const StereoRig& rig, const Eigen::Vector3d& way_m);
  void Project(Side side, const Water& water);
  void Paint(Side side, const Rows& rows);

  SnowParams params_;
  double frame_s_ = 0;
  std::vector<float> x_WF_m_, y_WF_m_, z_WF_m_;  // at the start, in the cube
  // At the frame under way: those in sight, the light on them, and their images.
  const view::RenderedStereo* seen_ = nullptr;
  StereoRegion region_;
  std::vector<Eigen::Vector3f> p_HF_;
  std::vector<Eigen::Array3f> irradiance_w_m2_;
  Stereo<Specks> specks_;
  std::vector<float> weights_;
};

}  // namespace turbidock::light
