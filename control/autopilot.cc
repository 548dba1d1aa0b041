#include "control/autopilot.h"

#include <utility>

#include "sim/base/check.h"

namespace turbidock::control {

PoseFilterParams ControlParams::pose_filter() const {
  if (own) return own->pose_filter;
  return controller == ControllerType::kPVoltage ? p_voltage.pose_filter
         : controller == ControllerType::kPid    ? pid.pose_filter
                                                 : PoseFilterParams{.enabled = false};
}

const SetpointParams& ControlParams::setpoint() const {
  if (own) return own->setpoint;
  return controller == ControllerType::kPVoltage ? p_voltage.setpoint
         : controller == ControllerType::kPid    ? pid.setpoint
                                                 : lqg.setpoint;
}

std::unique_ptr<Controller> MakeController(const ControlParams& params, const VehicleModel& vehicle,
                                           const ClockParams& clock) {
  if (params.own) return params.own->make(vehicle, clock);
  switch (params.controller) {
    case ControllerType::kPVoltage:
      return std::make_unique<PVoltage>(params.p_voltage);
    case ControllerType::kPid:
      return std::make_unique<Pid>(params.pid, vehicle, clock);
    case ControllerType::kLqg:
      return std::make_unique<Lqg>(params.lqg, vehicle, clock);
  }
  TD_CHECK(false, "unknown controller");
}

std::unique_ptr<Allocation> MakeAllocation(const ControlParams& params,
                                           const VehicleModel& vehicle) {
  if (params.own) {
    const auto* volts = std::get_if<VoltsAllocationParams>(&params.own->allocation);
    if (volts) return std::make_unique<VoltsAllocation>(*volts, vehicle);
    return std::make_unique<ForceAllocation>(
        std::get<ForceAllocationParams>(params.own->allocation), vehicle);
  }
  switch (params.controller) {
    case ControllerType::kPVoltage:
      return std::make_unique<VoltsAllocation>(params.p_voltage.allocation, vehicle);
    case ControllerType::kPid:
      return std::make_unique<ForceAllocation>(params.pid.allocation, vehicle);
    case ControllerType::kLqg:
      return std::make_unique<ForceAllocation>(params.lqg.allocation, vehicle);
  }
  TD_CHECK(false, "unknown controller");
}

Autopilot::Autopilot(const ControlParams& params, const ProcedureParams& procedure,
                     const VehicleModel& vehicle, const ClockParams& clock)
    : clock_(clock),
      vehicle_(vehicle),
      procedure_(procedure, clock),
      levelling_(params.levelling),
      filter_(params.pose_filter(), clock),
      setpoint_(params.setpoint(), clock),
      controller_(MakeController(params, vehicle, clock)),
      allocation_(MakeAllocation(params, vehicle)) {}

void Autopilot::SetControl(const ControlParams& params) {
  std::unique_ptr<Controller> controller = MakeController(params, vehicle_, clock_);
  std::unique_ptr<Allocation> allocation = MakeAllocation(params, vehicle_);
  PoseFilter filter(params.pose_filter(), clock_);
  setpoint_ = Setpoint(params.setpoint(), clock_);
  levelling_ = params.levelling;
  filter_ = filter;
  controller_ = std::move(controller);
  allocation_ = std::move(allocation);
  observed_ = false;
}

ThrusterCommand Autopilot::Update(const PoseEstimate& estimate, const Excitation& excitation,
                                  const Attitude& attitude) {
  const RollPitch level = LevellingMoment(levelling_, vehicle_, attitude);
  directive_ = &procedure_.Update(estimate);
  demand_.setZero();
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
    controller_->OnCommandApplied(estimate.frame, Axes::Zero());
    const Axes share = ToAxes(directive_->open_loop) / kNeutralVolts + excitation.share;
    return allocation_->Share(allocation_->authority().cwiseProduct(share), level).command;
  }
  const Axes desired = ToAxes(directive_->desired) + excitation.wanted;
  reference_ = setpoint_.Lead(estimate.frame, desired, ToAxes(estimate.X_HM));
  demand_ = controller_->Demand(reference_);
  const Axes added = allocation_->authority().cwiseProduct(excitation.share);
  const Allocated allocated = allocation_->Share(demand_ + added, level);
  controller_->OnCommandApplied(estimate.frame, allocated.given - added);
  return allocated.command;
}

}  // namespace turbidock::control
