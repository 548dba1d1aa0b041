#pragma once
// The vehicle's own control: estimates in, thruster commands out. The same code runs on a real
// vehicle.

#include <memory>
#include <optional>

#include "control/approach.h"
#include "control/controller_spec.h"
#include "control/docking_procedure.h"
#include "control/levelling.h"
#include "control/navigator.h"
#include "control/pose_filter.h"
#include "control/setpoint.h"
#include "control/thrust_allocation.h"
#include "control/vehicle_model.h"
#include "sim/base/clock.h"
#include "sim/base/navigation_reading.h"
#include "sim/base/pose_estimate.h"
#include "sim/base/thruster_command.h"

namespace turbidock::control {

// The controller, and what is done without one.
struct ControlParams {
  ControllerSpec controller;
  LevellingParams levelling{};
};

// What shares the controller's demand out to the vehicle's thrusters. ConfigError for a vehicle
// whose thrusters cannot follow it.
std::unique_ptr<Allocation> MakeAllocation(const ControllerSpec& controller,
                                           const VehicleModel& vehicle);

// What a test of the loop adds to it at a frame.
struct Excitation {
  Axes wanted = Axes::Zero();  // to the desired pose
  Axes share =
      Axes::Zero();  // of the vehicle's authority, to the demand; the controller is not told
};

// Docking procedure, pose filter, setpoint, controller and allocation. The procedure judges the
// estimate as it comes. The controller sees every usable one, also while another is in charge, so
// that taking over is no jump. A vehicle that can is kept level all the time. While the procedure
// has it steer by navigation another controller, slow enough for that, is in charge.
class Autopilot {
 public:
  Autopilot(const ControlParams& params, const ProcedureParams& procedure,
            const VehicleModel& vehicle, const ClockParams& clock,
            const ApproachParams& approach = {});  // checked: ConfigError

  // Frames must increase. `attitude`: what the vehicle's own sensor says; only levelling asks.
  // `reading`: of its navigation; only an approach asks.
  ThrusterCommand Update(const PoseEstimate& estimate, const Excitation& excitation = {},
                         const Attitude& attitude = {},
                         const std::optional<NavigationReading>& reading = {});

  // Another controller or other gains: controller, filter and setpoint begin anew, the procedure
  // goes on. Checked (ConfigError, and nothing has changed then).
  void SetControl(const ControlParams& params);

  // Of the last frame.
  const Directive& directive() const { return *directive_; }
  const Reference& reference() const { return reference_; }
  // The camera head in the marker's frame by navigation; nothing without one.
  std::optional<AxesPose> navigated_MH() const;
  // The same before the frame's estimate corrected it.
  const std::optional<AxesPose>& uncorrected_MH() const { return uncorrected_MH_; }
  const Axes& demand() const { return demand_; }  // of the controller, zero without control
  const Allocation& allocation() const { return *allocation_; }

 private:
  // What steers by navigation.
  struct NavigationLoop {
    Navigator navigator;
    Setpoint setpoint;  // of the camera head in the marker's frame
    Pid controller;
    ForceAllocation allocation;
    std::optional<Hand> hand = {};
  };
  void Observe(const PoseEstimate& estimate, const Attitude& attitude,
               const std::optional<NavigationReading>& reading);
  // What is known besides the estimate.
  Outlook OutlookAt(const PoseEstimate& estimate, const std::optional<NavigationReading>& reading);
  void CorrectNavigation(const PoseEstimate& estimate);
  ThrusterCommand SteerByNavigation(int64_t frame, const Excitation& excitation,
                                    const RollPitch& level);

  ClockParams clock_;
  VehicleModel vehicle_;
  DockingProcedure procedure_;
  LevellingParams levelling_;
  PoseFilter filter_;
  Setpoint setpoint_;
  std::unique_ptr<Controller> controller_;
  std::unique_ptr<Allocation> allocation_;
  std::optional<NavigationLoop> navigation_;
  std::optional<AxesPose> uncorrected_MH_;
  bool forces_;  // the controller asks for forces, not for volts
  bool observed_ = false;
  const Directive* directive_ = nullptr;
  Reference reference_;
  Axes demand_ = Axes::Zero();
};

}  // namespace turbidock::control
