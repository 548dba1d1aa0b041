#pragma once
// The vehicle's attitude sensor: which way is down, and how fast that changes.

#include <Eigen/Core>

#include "sim/base/attitude.h"
#include "sim/base/fields.h"
#include "sim/base/pose.h"
#include "sim/base/random.h"

namespace turbidock::vehicle {

// Guesses: what the data sheets of small MEMS attitude sensors promise (0.5 to 1 degree).
struct AttitudeSensorParams {
  double bias_std_rad = 0.01;
  double noise_std_rad = 0.003;
  double rate_noise_std_rad_s = 0.003;

  static void Fields(auto& self, auto&& field) {
    field("bias_std_rad", self.bias_std_rad, InRange(0, 0.5),
          "attitude sensor: standard deviation of a trial's constant error of measured roll and "
          "pitch");
    field("noise_std_rad", self.noise_std_rad, InRange(0, 0.5),
          "attitude sensor: standard deviation of the error of each reading of roll and pitch");
    field("rate_noise_std_rad_s", self.rate_noise_std_rad_s, InRange(0, 1),
          "attitude sensor: standard deviation of the error of each reading of the angular rates");
  }
};

class AttitudeSensor {
 public:
  AttitudeSensor(const AttitudeSensorParams& params, Rng rng);

  // A reading; each draws anew.
  Attitude Read(const Pose& X_WB, const Twist& V_WB_B);

 private:
  AttitudeSensorParams params_;
  Rng rng_;
  Eigen::Vector2d bias_rad_;
};

}  // namespace turbidock::vehicle
