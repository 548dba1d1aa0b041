#pragma once
// What can be set about water, lamps, lit balls and camera. Radiance is per colour channel,
// W m^-2 sr^-1; only its ratio to the camera's full scale can be observed.

#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/units.h"

namespace turbidock::light {

// The water before milk is added.
enum class Background {
  kPure,     // absorbs, does not scatter: the pool
  kClear,    // Petzold's clear sea (off the Bahamas)
  kCoastal,  // Petzold's coastal sea (San Pedro channel)
  kHarbor,   // Petzold's turbid harbour (San Diego)
  kCustom,   // the coefficients given beside it
};
constexpr auto Names(Background) {
  using enum Background;
  return EnumList<Background>({{kPure, "pure"},
                               {kClear, "clear"},
                               {kCoastal, "coastal"},
                               {kHarbor, "harbor"},
                               {kCustom, "custom"}});
}

// Eight times the most that was ever published of the experiment.
inline constexpr double kMaxMilk_ml_m3 = 2000;

struct WaterParams {
  Background background = Background::kPure;
  double milk_ml_m3 = 0;
  double scattering_scale = 1;
  // Homogenised milk, by dilution: Mie theory for 4 % of fat in droplets of 0.45 um and for casein
  // (tests/light/milk_oracle_test.cc). Times 1 - asymmetry it is 3.5, 4.4 and 5.0 per mm undiluted;
  // measured were 2.6 to 4.6, 3.2 to 5.8 and 3.8 to 7.1 (Jensen et al. 2001, whole milk;
  // Narasimhan, Gupta et al. 2006, regular milk). 1 ml/m^3 is a part in 10^6.
  Eigen::Vector3d milk_scattering_m2_ml{0.0224, 0.0323, 0.0414};
  Eigen::Vector3d milk_asymmetry{0.842, 0.865, 0.880};
  // Used with background: custom. Default: pure water at 625, 525 and 465 nm (Pope & Fry 1997).
  Eigen::Vector3d absorption_per_m{0.28, 0.045, 0.015};
  Eigen::Vector3d scattering_per_m{0, 0, 0};
  Eigen::Vector3d asymmetry{0.924, 0.924, 0.924};
  bool multiple_scattering = true;
  double port_m = 0.02;
  bool surface_halos = true;

  static void Fields(auto& self, auto&& field) {
    field("background", self.background, Finite(),
          "the water without milk: what it absorbs and scatters");
    field("milk_ml_m3", self.milk_ml_m3, InRange(0, kMaxMilk_ml_m3),
          "milk in the water, ml in a cubic metre");
    field("scattering_scale", self.scattering_scale, InRange(0.1, 3),
          "factor on the milk's scattering: sort of milk, 0.75 to 1.3 in the literature");
    field("milk_scattering_m2_ml", self.milk_scattering_m2_ml, InRange(0, 1),
          "scattering coefficient (1/m) that 1 ml/m^3 of milk adds, for red, green and blue");
    field("milk_asymmetry", self.milk_asymmetry, InRange(-0.99, 0.99),
          "mean cosine of the angle by which milk scatters, for red, green and blue");
    field("absorption_per_m", self.absorption_per_m, InRange(0, 20),
          "absorption (1/m) of water whose background is custom, for red, green and blue");
    field("scattering_per_m", self.scattering_per_m, InRange(0, 20),
          "scattering (1/m) of water whose background is custom, for red, green and blue");
    field("asymmetry", self.asymmetry, InRange(-0.99, 0.99),
          "mean cosine of the angle by which water whose background is custom scatters");
    field("multiple_scattering", self.multiple_scattering, Finite(),
          "whether water scatters light more than once");
    field("port_m", self.port_m, InRange(0, 0.2),
          "distance in front of the camera at which the water begins");
    field("surface_halos", self.surface_halos, Finite(),
          "whether the water glows in the light that marker and station throw back from the lamps");
  }
};

enum class BeamShape {
  kIsotropic,  // equal in all directions
  kCosine,     // cos^m of the angle from the axis, forward only
  kCone,       // constant inside the cone, a smooth step to nothing at its edge
};
constexpr auto Names(BeamShape) {
  using enum BeamShape;
  return EnumList<BeamShape>({{kIsotropic, "isotropic"}, {kCosine, "cosine"}, {kCone, "cone"}});
}

// Both lamps. They stand at the scene's sites lamp_*, beam along the site's x axis, moved by
// `shift_m` and turned, each the other's mirror image. Shadows of the vehicle's own parts count.
struct LampParams {
  bool enabled = false;
  // Guess, set so that the painted balls are 120 to 200 DN at 0.6 m at the default exposure. The
  // published vehicle has two lamps of 5.8 W electrical, about 1.5 W radiant over the whole
  // spectrum.
  Eigen::Vector3d intensity_w_sr{0.04, 0.04, 0.04};
  BeamShape beam = BeamShape::kCosine;
  double cosine_exponent = 1;  // 1: bare LED; 4 to 20: reflector
  double cone_half_angle_rad = units::RadFromDeg(50);
  double cone_soft_rad = units::RadFromDeg(12.5);
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
  double toe_in_rad = 0, tilt_rad = 0;

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Finite(), "whether the vehicle's lamps shine");
    field("intensity_w_sr", self.intensity_w_sr, InRange(0, 1000),
          "radiant intensity of a lamp on its axis, for red, green and blue");
    field("beam", self.beam, Finite(),
          "shape of a lamp's beam: fall of its intensity with the angle from its axis");
    field("cosine_exponent", self.cosine_exponent, InRange(0, 200),
          "exponent m of a lamp's cos^m beam");
    field("cone_half_angle_rad", self.cone_half_angle_rad, InRange(0.02, 1.57),
          "outer half angle of a cone beam");
    field("cone_soft_rad", self.cone_soft_rad, InRange(0.001, 1.57),
          "width of a cone beam's edge, inside the half angle");
    field("shift_m", self.shift_m, InRange(-0.3, 0.3),
          "shift of both lamps from the scene's sites: forwards, outwards, up");
    field("toe_in_rad", self.toe_in_rad, InRange(-0.8, 0.8),
          "angle by which the lamps' beams are turned inwards");
    field("tilt_rad", self.tilt_rad, InRange(-0.8, 0.8),
          "angle by which the lamps' beams are turned up");
  }
};

// The light inside one ball.
struct BallLight {
  std::string name;  // of the geom without "ball_"
  Eigen::Vector3d color{1, 1, 1};
  double current_factor = 1;

  static void Fields(auto& self, auto&& field) {
    field("name", self.name, Finite(), "name of a lit ball, as in the scene");
    field("color", self.color, InRange(0, 1),
          "share of a lit ball's light that the camera's red, green and blue channels see");
    field("current_factor", self.current_factor, InRange(0, 20),
          "LED current relative to the published one (red 5.7, green and blue 3.4 mA)");
  }
};

// The active marker's balls: an LED inside a translucent skin, brighter in the middle. Where the
// ray passes the centre at distance r the radiance is rim + core exp(-r^2 / (2 width^2)).
struct BallLightParams {
  bool enabled = true;
  // About 1.3 mW leave a ball (10 mW electrical, a quarter becomes light, half passes the skin), a
  // mean radiance of 0.08; the split into rim and core is a guess from the published best at some
  // milk.
  double rim_radiance_w_m2_sr = 0.063;
  double core_radiance_w_m2_sr = 0.083;
  double core_width_m = 0.0065;
  // Colours: guess, saturated LEDs with a little crosstalk.
  std::vector<BallLight> balls = {
      {"red", {1, 0.03, 0.03}}, {"green", {0.03, 1, 0.08}}, {"blue", {0.03, 0.10, 1}}};

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Finite(), "whether the balls shine (active marker)");
    field("rim_radiance_w_m2_sr", self.rim_radiance_w_m2_sr, InRange(0, 1000),
          "radiance of a lit ball at the edge of its disc");
    field("core_radiance_w_m2_sr", self.core_radiance_w_m2_sr, InRange(0, 1000),
          "radiance added in the middle of a lit ball's disc");
    field("core_width_m", self.core_width_m, InRange(0.0005, 0.1),
          "width (sigma) of a lit ball's bright core");
    field("balls", self.balls, Finite(), "the lit balls");
  }
  void Check(const std::string& path) const;
};

// How exactly light is computed.
struct ShadingParams {
  int tile_px = 16;
  double relative_tolerance = 0.01;
  double absolute_tolerance_w_m2_sr =
      5e-6;  // about a tenth of a DN at black with the default camera

  static void Fields(auto& self, auto&& field) {
    field("tile_px", self.tile_px, InRange(1, 64),
          "largest tile of surface that is interpolated from its corners, rounded down to a power "
          "of two; 1 computes every pixel");
    field("relative_tolerance", self.relative_tolerance, InRange(0, 0.2),
          "error allowed in a tile's middle, as a share of the radiance there");
    field("absolute_tolerance_w_m2_sr", self.absolute_tolerance_w_m2_sr, InRange(0, 1),
          "error allowed in a tile's middle, besides relative_tolerance");
  }
};

struct OpticsParams {
  WaterParams water;
  LampParams lamps;
  BallLightParams ball_lights;
  ShadingParams shading;

  static void Fields(auto& self, auto&& field) {
    field("water", self.water, Finite(), "water: what it absorbs and scatters");
    field("lights.lamps", self.lamps, Finite(), "the vehicle's lamps");
    field("lights.marker", self.ball_lights, Finite(), "the light in the marker's balls");
    field("lights.shading", self.shading, Finite(), "how exactly light is computed");
  }
};

}  // namespace turbidock::light
