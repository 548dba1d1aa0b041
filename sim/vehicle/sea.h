#pragma once
// The moving water: current with depth and gusts, waves, and the tether that it drags along.

#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/random.h"

namespace turbidock::vehicle {

// Water that moves past without asking the vehicle.
struct CurrentParams {
  Eigen::Vector3d surface_velocity_mps{0, 0, 0};
  InputFile file = {};
  double decay_depth_m = 0;
  double gust_std_mps = 0;
  double gust_time_constant_s = 10;

  static void Fields(auto& self, auto&& field) {
    field("surface_velocity_mps", self.surface_velocity_mps, InRange(-5, 5),
          "mean current at the surface: x, y, z in the world's frame W");
    field("file", self.file, Finite(),
          "CSV of a measured current at the surface, in place of surface_velocity_mps: columns "
          "time_s, water_x_mps, water_y_mps and perhaps water_z_mps, in the world's frame W, or "
          "speed_mps and direction_rad (towards which it runs, from W's x towards y); linear "
          "between rows");
    field("decay_depth_m", self.decay_depth_m, AtLeast(0),
          "depth at which the current has fallen to 1/e of the surface's; 0: it does not fall");
    field("gust_std_mps", self.gust_std_mps, InRange(0, 2),
          "standard deviation of the current's Gauss-Markov gusts, of each horizontal component");
    field("gust_time_constant_s", self.gust_time_constant_s, Above(0),
          "time in which the correlation of the current's gusts falls to 1/e");
  }
  void Check(const std::string& path) const;  // one of mean and file
};

// A current that was measured: in W, linear from one row to the next, held at both ends.
struct MeasuredCurrent {
  double time_s = 0;
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
};
using CurrentSeries = std::vector<MeasuredCurrent>;

// How rough the sea is, as one regular wave across the dock (along W's y). The published trials
// name no sea; height and period are derived from what a vehicle at 0.5 m (calm) or 0.7 m of depth
// can stand, with the speed of the water there.
enum class SeaState {
  kCustom,    // no wave but those spelt out
  kCalm,      // 0.05 m, 2 s: 0.047 m/s
  kModerate,  // 0.10 m, 2.5 s: 0.080 m/s
  kRough,     // 0.20 m, 3 s: 0.153 m/s, more than the docking tolerance forgives
};
constexpr auto Names(SeaState) {
  using enum SeaState;
  return EnumList<SeaState>(
      {{kCustom, "custom"}, {kCalm, "calm"}, {kModerate, "moderate"}, {kRough, "rough"}});
}

// One regular long-crested wave, deep water.
struct WaveComponent {
  double height_m = 0.1;
  double period_s = 2.5;
  double direction_rad = 0;
  double phase_rad = 0;

  static void Fields(auto& self, auto&& field) {
    field("height_m", self.height_m, InRange(0, 20), "height of a regular wave, crest to trough");
    field("period_s", self.period_s, InRange(0.2, 60), "period of a regular wave");
    field("direction_rad", self.direction_rad, Finite(),
          "direction in which a regular wave runs, from the x of the world's frame W towards y");
    field("phase_rad", self.phase_rad, Finite(),
          "phase of a regular wave at the origin of the world's frame W and time 0 (crest: 0); "
          "used when random_phases is off");
  }
};

// Irregular sea with a JONSWAP spectrum (Hasselmann et al. 1973), long-crested.
struct JonswapParams {
  double significant_height_m = 0;
  double peak_period_s = 3;
  double gamma = 3.3;
  double direction_rad = 0;
  int components = 24;

  static void Fields(auto& self, auto&& field) {
    field("significant_height_m", self.significant_height_m, InRange(0, 20),
          "significant wave height of the irregular sea; 0: none");
    field("peak_period_s", self.peak_period_s, InRange(0.5, 30),
          "peak period of the irregular sea");
    field("gamma", self.gamma, InRange(1, 10),
          "factor gamma by which the peak of the JONSWAP spectrum is enhanced");
    field("direction_rad", self.direction_rad, Finite(),
          "direction in which the irregular sea runs, from the x of the world's frame W towards y");
    field("components", self.components, InRange(1, 500),
          "number of regular waves that the irregular sea is summed from");
  }
};

// A cable from the vehicle to a fixed point, as two end points and the water between: each end
// carries half of the cable's drag and half of its weight in water, and the cable pulls once it is
// stretched.
struct TetherParams {
  bool enabled = false;
  Eigen::Vector3d p_BQ_m{-0.19, 0, 0.1};
  Eigen::Vector3d p_WAnchor_m{-12, 0, -0.5};
  double length_m = 20;
  double diameter_m = 0.008;
  double drag_coefficient = 1.2;
  double net_weight_newton_per_m = 0;
  double stiffness_newton_per_m = 200;
  double stretch_damping_newton_s_per_m = 40;
  double water_density_kg_m3 = 1025;

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Finite(), "whether the vehicle drags a tether");
    field("p_BQ_m", self.p_BQ_m, InRange(-10, 10),
          "point where the tether leaves the vehicle: x, y, z in the vehicle's frame B");
    field("p_WAnchor_m", self.p_WAnchor_m, Finite(),
          "far end of the tether: x, y, z in the world's frame W");
    field("length_m", self.length_m, Above(0), "length of the tether in the water");
    field("diameter_m", self.diameter_m, InRange(1e-4, 0.2), "diameter of the tether");
    field("drag_coefficient", self.drag_coefficient, InRange(0, 5),
          "drag coefficient of the tether across the flow: 1.2 for a smooth cylinder, more when it "
          "strums");
    field("net_weight_newton_per_m", self.net_weight_newton_per_m, InRange(-100, 100),
          "weight of a metre of the tether less its buoyancy; positive sinks");
    field("stiffness_newton_per_m", self.stiffness_newton_per_m, AtLeast(0),
          "pull of the tether per metre of stretch beyond its length");
    field("stretch_damping_newton_s_per_m", self.stretch_damping_newton_s_per_m, AtLeast(0),
          "pull of the tether per m/s of stretching, while taut");
    field("water_density_kg_m3", self.water_density_kg_m3, InRange(0, 2000),
          "density of the water about the tether");
  }
};

struct SeaParams {
  SeaState state = SeaState::kCustom;
  CurrentParams current{};
  std::vector<WaveComponent> waves{};
  JonswapParams jonswap{};
  bool random_phases = true;
  TetherParams tether{};

  static void Fields(auto& self, auto&& field) {
    field("state", self.state, Finite(),
          "sea state whose wave is added to sea.waves; custom adds none");
    field("current", self.current, Finite(), "current of the sea and its gusts");
    field("waves", self.waves, Finite(), "regular waves of the sea");
    field("jonswap", self.jonswap, Finite(),
          "irregular sea (JONSWAP spectrum), added to sea.waves");
    field("random_phases", self.random_phases, Finite(),
          "whether the regular waves' phases are drawn from the trial's seed");
    field("tether", self.tether, Finite(), "cable from the vehicle to the surface");
  }
};

// Velocity and acceleration of the undisturbed water at a point, in W.
struct WaterMotion {
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d a_W = Eigen::Vector3d::Zero();
};

// A value: copies run on independently and equally. Waves are linear (Airy) in deep water, u ~
// exp(k z) with k = w^2 / g, taken at the point given and held at z = 0 above it; the current does
// not shift their frequency. A gust is the same everywhere and linear within a tick.
class Sea {
 public:
  Sea() = default;  // still water
  // `measured`: what the parameters' file holds; its times must increase.
  Sea(const SeaParams& params, Rng rng, CurrentSeries measured = {});

  // Becomes another sea in mid-sea: its waves are those it would have had from the beginning, the
  // gust of the moment goes on, scaled. Gusts where there were none begin from nothing. The series
  // stays.
  void Become(const SeaParams& params);

  // Moves the gusts on to the tick of length dt_s that begins now (exact for any length), the
  // measured current to begin_s.
  void Step(double dt_s, double begin_s = 0);

  // Current and gust at the beginning of that tick, without the waves, in W.
  Eigen::Vector3d Current(const Eigen::Vector3d& p_WQ) const;

  // How far current and gusts have carried the water at that depth by the end of that tick, in W.
  Eigen::Vector3d Drift(const Eigen::Vector3d& p_WQ) const;

  // At the beginning of that tick.
  WaterMotion At(const Eigen::Vector3d& p_WQ, double time_s) const;

  // Elevation of the surface above z = 0.
  double Elevation(const Eigen::Vector3d& p_WQ, double time_s) const;

  // Pull of the tether on its end at p_WQ that moves with v_WQ, in W; zero without a tether.
  Eigen::Vector3d TetherForce(const Eigen::Vector3d& p_WQ, const Eigen::Vector3d& v_WQ,
                              double time_s) const;

  const TetherParams& tether() const { return params_.tether; }

 private:
  struct Wave {
    double amplitude_m, omega_rad_s, k_rad_m, phase_rad;
    double cos_direction, sin_direction;
  };

  void MakeWaves();  // draws from rng_
  void Measure(double time_s);
  double Remaining(double z_m) const;  // share of the current at the surface

  SeaParams params_;
  std::vector<Wave> waves_;
  Rng rng_{0, 0};
  Rng first_rng_{0, 0};                                   // as it was before the waves were drawn
  Eigen::Vector2d gust_begin_ = Eigen::Vector2d::Zero();  // m/s, x and y of W
  Eigen::Vector2d gust_end_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d gust_rate_ = Eigen::Vector2d::Zero();  // m/s^2, over the tick
  // m, since the beginning: of the current at the surface and of the gusts
  Eigen::Vector3d drift_ = Eigen::Vector3d::Zero();
  Eigen::Vector2d gust_drift_ = Eigen::Vector2d::Zero();
  CurrentSeries series_;
  Eigen::Vector3d measured_ = Eigen::Vector3d::Zero();       // at the surface, now
  Eigen::Vector3d measured_rate_ = Eigen::Vector3d::Zero();  // m/s^2
};

}  // namespace turbidock::vehicle
