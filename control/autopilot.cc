#include "control/autopilot.h"

#include <utility>

#include "sim/base/check.h"

namespace turbidock::control {

PoseFilterParams ControlParams::pose_filter() const {
  return controller == Law::kPVoltage ? p_voltage.pose_filter
         : controller == Law::kPid    ? pid.pose_filter
                                      : PoseFilterParams{.enabled = false};
}

const SetpointParams& ControlParams::setpoint() const {
  return controller == Law::kPVoltage ? p_voltage.setpoint
         : controller == Law::kPid    ? pid.setpoint
                                      : lqg.setpoint;
}

const AllocationParams& ControlParams::allocation() const {
  return controller == Law::kPVoltage ? p_voltage.allocation
         : controller == Law::kPid    ? pid.allocation
                                      : lqg.allocation;
}

std::unique_ptr<Controller> MakeController(const ControlParams& params, const ClockParams& clock) {
  switch (params.controller) {
    case Law::kPVoltage:
      return std::make_unique<PVoltage>(params.p_voltage);
    case Law::kPid:
      return std::make_unique<Pid>(params.pid, clock);
    case Law::kLqg:
      return std::make_unique<Lqg>(params.lqg, clock);
  }
  TD_CHECK(false, "unknown control law");
}

Autopilot::Autopilot(const ControlParams& params, const ProcedureParams& procedure,
                     const ClockParams& clock)
    : clock_(clock),
      allocation_(params.allocation()),
      procedure_(procedure, clock),
      filter_(params.pose_filter(), clock),
      setpoint_(params.setpoint(), clock),
      controller_(MakeController(params, clock)) {}

void Autopilot::SetControl(const ControlParams& params) {
  std::unique_ptr<Controller> controller = MakeController(params, clock_);
  PoseFilter filter(params.pose_filter(), clock_);
  setpoint_ = Setpoint(params.setpoint(), clock_);
  filter_ = filter;
  controller_ = std::move(controller);
  allocation_ = params.allocation();
  observed_ = false;
}

ThrusterCommand Autopilot::Update(const PoseEstimate& estimate, const Excitation& excitation) {
  directive_ = &procedure_.Update(estimate);
  demand_ = {};
  if (directive_->trusted) {
    TD_CHECK(estimate.X_HM.IsFinite(), "estimated pose must be finite");
    const auto seen = filter_.Update(
        {.frame = estimate.frame, .position = ToAxes(estimate.X_HM), .rate = std::nullopt});
    if (seen) {
      controller_->Observe(*seen);
      observed_ = true;
    }
  }
  if (!directive_->control || !observed_) {
    setpoint_.Restart();
    controller_->Given(estimate.frame, {});
    // The search's volts are meant as they are.
    return Allocate({}, directive_->open_loop + excitation.volts);
  }
  const Axes desired = ToAxes(directive_->desired) + excitation.wanted;
  reference_ = setpoint_.Lead(estimate.frame, desired, ToAxes(estimate.X_HM));
  demand_ = controller_->Demand(reference_);
  const AxisVolts given = Attainable(allocation_, demand_ + excitation.volts);
  controller_->Given(estimate.frame, given - excitation.volts);
  return Allocate(allocation_, given);
}

}  // namespace turbidock::control
