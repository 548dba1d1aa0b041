#include "control/levelling.h"

namespace turbidock::control {

RollPitch LevellingMoment(const LevellingParams& params, const VehicleModel& vehicle,
                          const Attitude& attitude) {
  if (!params.enabled) return RollPitch::Zero();
  return -vehicle.roll_pitch_inertia.cwiseProduct(params.kp_per_s2 * attitude.roll_pitch_rad +
                                                  params.kd_per_s * attitude.rate_rad_s);
}

}  // namespace turbidock::control
