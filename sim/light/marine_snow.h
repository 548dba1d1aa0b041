#pragma once
// Marine snow: suspended particles large enough to be seen one by one, in the light of the lamps
// and of the lit balls.
//
// The particles fill space: a cube of random places that repeats itself. They rest in the water but
// for their sinking. A particle scatters alike in all directions, so that its intensity is
// albedo E R^2 / 4 for the irradiance E of lamps and balls. Left out: particles out of focus.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/fields.h"
#include "sim/base/image.h"
#include "sim/light/radiance.h"
#include "sim/view/rendered.h"

namespace turbidock::light {

class Water;

struct SnowParams {
  double particles_per_m3 = 0;
  // Marine snow is larger than 0.5 mm and sinks some 50 to 100 m a day (Alldredge & Silver 1988).
  double diameter_m = 0.001;
  double sink_m_s = 0.001;
  double albedo = 0.3;  // a guess

  static void Fields(auto& self, auto&& field) {
    field("particles_per_m3", self.particles_per_m3, InRange(0, 20000), "particles; 0: none");
    field("diameter_m", self.diameter_m, InRange(1e-4, 0.02), "diameter of a particle");
    field("sink_m_s", self.sink_m_s, InRange(0, 0.1), "speed of its sinking");
    field("albedo", self.albedo, InRange(0, 1), "share of light that a particle throws back");
  }
};

class MarineSnow {
 public:
  MarineSnow() = default;  // none
  // `frame_s` between images; places are drawn from the key.
  MarineSnow(const SnowParams& params, double frame_s, uint64_t key);

  bool on() const { return !p_WF_.empty(); }
  // Adds the particles' light at a frame to what both cameras see. `water` has been prepared
  // for `seen`.
  void Fall(const view::RenderedStereo& seen, int64_t frame, Water* water, RadianceStereo* images);

 private:
  void Paint(const MountedCamera& camera, const view::RenderedView& view,
             const Eigen::Array3f& extinction_per_m, Image3f* image) const;

  SnowParams params_;
  double frame_s_ = 0;
  std::vector<Eigen::Vector3d> p_WF_;  // at the start, in the cube
  // Those before the cameras at the frame under way, and the light on them.
  std::vector<Eigen::Vector3f> p_HF_;
  std::vector<Eigen::Array3f> irradiance_w_m2_;
};

}  // namespace turbidock::light
