#pragma once
// How the desired pose moves: from where the vehicle is, never faster than it can follow.

#include <cstdint>
#include <optional>

#include "control/controller.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"

namespace turbidock::control {

struct SetpointParams {
  bool enabled = false;  // published: the desired pose jumps
  // Of x, y, z and heading. Full thrust takes the vehicle to 0.4 m/s ahead, where the moment of the
  // water (Munk) turns it off its course faster than the thrusters can hold it.
  Eigen::Vector4d speed{0.15, 0.08, 0.08, 0.1};
  Eigen::Vector4d acceleration{0.08, 0.05, 0.05, 0.05};

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Finite(),
          "whether the desired pose is led from the present one with limited speed");
    field("speed", self.speed, Above(0),
          "desired pose: largest speed of its x, y, z [m/s] and yaw [rad/s]");
    field("acceleration", self.acceleration, Above(0),
          "desired pose: largest acceleration of its x, y, z [m/s^2] and yaw [rad/s^2]");
  }
};

// Leads each axis to its desired value with limited speed and acceleration: it speeds up, cruises
// and slows down to stand still at the goal. Where control begins, the lead begins at the pose that
// is seen, so no stage begins with a jump. Not enabled, the reference is the desired pose.
class Setpoint {
 public:
  Setpoint(const SetpointParams& params, const ClockParams& clock);  // checked: ConfigError

  // The reference of this frame. `seen` is where the marker is, used where a lead begins. Frames
  // must increase; the lead moves on over frames without a call.
  const Reference& Lead(int64_t frame, const Axes& desired, const Axes& seen);

  // The next lead begins anew.
  void Restart() { last_frame_.reset(); }

 private:
  void Step(int axis, double goal);

  SetpointParams params_;
  ClockParams clock_;
  std::optional<int64_t> last_frame_;
  Reference reference_;
};

}  // namespace turbidock::control
