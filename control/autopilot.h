#pragma once
// The vehicle's own control: estimates in, thruster commands out. The same code runs on a real
// vehicle.

#include <memory>

#include "control/controller.h"
#include "control/docking_procedure.h"
#include "control/lqg.h"
#include "control/p_voltage.h"
#include "control/pid.h"
#include "control/pose_filter.h"
#include "control/setpoint.h"
#include "control/thrust_allocation.h"
#include "sim/base/clock.h"
#include "sim/base/pose_estimate.h"
#include "sim/base/thruster_command.h"

namespace turbidock::control {

enum class Law {
  kPVoltage,  // the published law
  kPid,
  kLqg,
};
constexpr auto Names(Law) {
  using enum Law;
  return EnumList<Law>({{kPVoltage, "p_voltage"}, {kPid, "pid"}, {kLqg, "lqg"}});
}

// Which law, and the parameters of each; the others' are kept but not used.
struct ControlParams {
  Law controller = Law::kPVoltage;
  PVoltageParams p_voltage;
  PidParams pid;
  LqgParams lqg;

  // Pose filter and setpoint of the chosen law; lqg has a filter of its own.
  PoseFilterParams pose_filter() const;
  const SetpointParams& setpoint() const;
  const AllocationParams& allocation() const;
};

std::unique_ptr<Controller> MakeController(const ControlParams& params, const ClockParams& clock);

// What a test of the loop adds to it at a frame.
struct Excitation {
  Axes wanted = Axes::Zero();  // to the desired pose
  AxisVolts volts;             // to the law's demand; the law is not told
};

// Docking procedure, pose filter, setpoint, law and allocation. The procedure judges the estimate
// as it comes. The law sees every usable one, also while another is in charge, so that taking over
// is no jump.
class Autopilot {
 public:
  Autopilot(const ControlParams& params, const ProcedureParams& procedure,
            const ClockParams& clock);  // checked: ConfigError

  // Frames must increase.
  ThrusterCommand Update(const PoseEstimate& estimate, const Excitation& excitation = {});

  // Another law or other gains: law, filter and setpoint begin anew, the procedure goes on. Checked
  // (ConfigError, and nothing has changed then).
  void SetControl(const ControlParams& params);

  // Of the last frame.
  const Directive& directive() const { return *directive_; }
  const Reference& reference() const { return reference_; }
  const AxisVolts& demand() const { return demand_; }  // of the law, zero without control

 private:
  ClockParams clock_;
  AllocationParams allocation_;
  DockingProcedure procedure_;
  PoseFilter filter_;
  Setpoint setpoint_;
  std::unique_ptr<Controller> controller_;
  bool observed_ = false;
  const Directive* directive_ = nullptr;
  Reference reference_;
  AxisVolts demand_;
};

}  // namespace turbidock::control
