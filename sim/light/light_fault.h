#pragma once
// What goes wrong with light: lamps and LEDs that die or flicker, a day that comes.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "sim/base/fault.h"
#include "sim/light/optics_params.h"

namespace turbidock::light {

// In the order of LampPoses, as the scene's sites are called.
inline constexpr const char* kLampNames[] = {"lamp_left", "lamp_right"};

struct LightFault : FaultSpan {
  std::string light = "lamp_left";
  double factor = 0;
  double flicker_hz = 0;

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("light", self.light, Finite(),
          "light that fails: lamp_left, lamp_right or a ball's name");
    field("factor", self.factor, InRange(0, 5),
          "factor on the brightness of the failing light: 0 dead, 1 sound");
    field("flicker_hz", self.flicker_hz, InRange(0, 100),
          "frequency at which the failing light comes back, for half of each period; 0: never");
  }
  // ConfigError where neither a lamp nor one of these balls is called so.
  void CheckLight(const std::string& path, const std::vector<BallLight>& balls) const;
};

double FactorAt(const LightFault& fault, double time_s);

// The lights as faults leave them.
struct LightsNow {
  std::vector<double> lamp_factors{1, 1};  // left, right
  BallLightParams balls;
};
LightsNow LightsAt(const BallLightParams& balls, const std::vector<LightFault>& faults,
                   double time_s);

// Daylight that grows from nothing.
struct AmbientLightFault : FaultSpan {
  double rise_s = 20;
  Eigen::Vector3d irradiance_w_m2{0.05, 0.05, 0.05};

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("rise_s", self.rise_s, InRange(0.001, kLongest_s),
          "time in which the ambient daylight grows to its full strength");
    field("irradiance_w_m2", self.irradiance_w_m2, InRange(0, 1000),
          "irradiance by the full ambient daylight of a surface that faces up where the vehicle "
          "is: red, green, blue");
  }
};

Eigen::Array3d DaylightAt(const std::vector<AmbientLightFault>& faults, double time_s);

}  // namespace turbidock::light
