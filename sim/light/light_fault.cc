#include "sim/light/light_fault.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace turbidock::light {

void BallLightParams::Check(const std::string& path) const {
  for (size_t i = 0; i < balls.size(); ++i)
    for (size_t before = 0; before < i; ++before)
      if (balls[i].name == balls[before].name)
        throw ConfigError(JoinKey(path, "balls[" + std::to_string(i) + "].name"),
                          "'" + balls[i].name + "' is given twice");
}

void LightFault::CheckLight(const std::string& path, const std::vector<BallLight>& balls) const {
  std::string known;
  for (const char* lamp : kLampNames) {
    if (light == lamp) return;
    known += std::string(known.empty() ? "" : ", ") + lamp;
  }
  for (const BallLight& ball : balls) {
    if (light == ball.name) return;
    known += ", " + ball.name;
  }
  throw ConfigError(JoinKey(path, "light"), "'" + light + "' must be one of " + known);
}

double FactorAt(const LightFault& fault, double time_s) {
  if (!fault.Holds(time_s)) return 1;
  const double periods = (time_s - fault.begin_s) * fault.flicker_hz;
  return periods - std::floor(periods) < 0.5 ? fault.factor : 1;
}

LightsNow LightsAt(const BallLightParams& balls, const std::vector<LightFault>& faults,
                   double time_s) {
  LightsNow now;
  now.balls = balls;
  for (const LightFault& fault : faults) {
    const double factor = FactorAt(fault, time_s);
    for (size_t i = 0; i < std::size(kLampNames); ++i)
      if (fault.light == kLampNames[i]) now.lamp_factors[i] *= factor;
    for (BallLight& ball : now.balls.balls)
      if (fault.light == ball.name) ball.current_factor *= factor;
  }
  return now;
}

Eigen::Array3d DaylightAt(const std::vector<AmbientLightFault>& faults, double time_s) {
  Eigen::Array3d sum_w_m2 = Eigen::Array3d::Zero();
  for (const AmbientLightFault& day : faults)
    if (day.Holds(time_s))
      sum_w_m2 += day.irradiance_w_m2.array() * std::min(1.0, (time_s - day.begin_s) / day.rise_s);
  return sum_w_m2;
}

}  // namespace turbidock::light
