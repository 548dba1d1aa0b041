#include "experiments/trial/motion.h"

#include <cstddef>

namespace turbidock::trial {
namespace {

// Calls add(name, value) for each column, in their order.
template <class Add>
void VisitMotion(const MotionTick& tick, const std::vector<std::string>& thrusters,
                 const Add& add) {
  const Pose X = tick.truth.X_WB.Canonical();
  const Twist& V = tick.truth.V_WB_B;
  add("time_s", tick.time_s);
  add("vehicle_x_m", X.p.x());
  add("vehicle_y_m", X.p.y());
  add("vehicle_z_m", X.p.z());
  add("vehicle_qw", X.q.w());
  add("vehicle_qx", X.q.x());
  add("vehicle_qy", X.q.y());
  add("vehicle_qz", X.q.z());
  add("surge_mps", V.v.x());
  add("sway_mps", V.v.y());
  add("heave_mps", V.v.z());
  add("roll_rate_rad_s", V.w.x());
  add("pitch_rate_rad_s", V.w.y());
  add("yaw_rate_rad_s", V.w.z());
  add("measured_roll_rad", tick.measured.roll_pitch_rad.x());
  add("measured_pitch_rad", tick.measured.roll_pitch_rad.y());
  add("water_x_mps", tick.water_v_W.x());
  add("water_y_mps", tick.water_v_W.y());
  add("water_z_mps", tick.water_v_W.z());
  for (size_t i = 0; i < thrusters.size(); ++i)
    add(thrusters[i] + "_v", tick.command.volts.empty() ? kNeutralVolts : tick.command.volts[i]);
  for (size_t i = 0; i < thrusters.size(); ++i)
    add(thrusters[i] + "_thrust_newton",
        tick.truth.thrust_newton.empty() ? 0 : tick.truth.thrust_newton[i]);
  // in the controller's unit: newtons and newton metres, or volts
  add("demand_surge", tick.demand[control::kSurge]);
  add("demand_sway", tick.demand[control::kSway]);
  add("demand_heave", tick.demand[control::kHeave]);
  add("demand_yaw", tick.demand[control::kYaw]);
}

}  // namespace

std::vector<std::string> ThrusterNamesOf(const Scenario& scenario) {
  return vehicle::NamesOf(vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig).thrusters);
}

MotionLog::MotionLog(const std::vector<std::string>& thrusters) : thrusters_(thrusters) {
  constexpr size_t kReserved = 1 << 16;  // two minutes of the usual clock; a longer log grows
  VisitMotion({}, thrusters, [this](const std::string& name, double) {
    table_.names.push_back(name);
    table_.columns.emplace_back().reserve(kReserved);
  });
}

void MotionLog::Add(const MotionTick& tick) {
  size_t at = 0;
  VisitMotion(tick, thrusters_,
              [&](const std::string&, double value) { table_.columns[at++].push_back(value); });
}

}  // namespace turbidock::trial
