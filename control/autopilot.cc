#include "control/autopilot.h"

#include <cmath>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

bool AsksForForces(const ControlParams& params) {
  if (params.own) return !std::holds_alternative<VoltsAllocationParams>(params.own->allocation);
  return params.controller != ControllerType::kPVoltage;
}

// Heading is nearly the rotation about z of H: the vehicle hardly pitches and rolls.
std::optional<Axes> VarianceOf(const PoseEstimate& estimate) {
  if (!estimate.covariance) return std::nullopt;
  const PoseCovariance& of = *estimate.covariance;
  return Axes(of(0, 0), of(1, 1), of(2, 2), of(5, 5));
}

// The camera head as it is wanted, seen from where it is; both in M.
Observation SeenFrom(const Navigated& now, const Reference& wanted_MH, int64_t frame) {
  const double c = std::cos(now.pose_MH.yaw_rad), s = std::sin(now.pose_MH.yaw_rad);
  const auto in_head = [&](const Axes& in_M) -> Axes {
    return {c * in_M.x() + s * in_M.y(), c * in_M.y() - s * in_M.x(), in_M.z(), in_M.w()};
  };
  return {.frame = frame,
          .position = in_head(Difference(wanted_MH.position, ToAxes(now.pose_MH))),
          .rate = in_head(wanted_MH.rate - now.rate_M)};
}

}  // namespace

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
    case ControllerType::kPlayback:
      return std::make_unique<OpenLoop>();
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
    case ControllerType::kPlayback:
      return std::make_unique<ForceAllocation>(ForceAllocationParams{}, vehicle,
                                               /*may_lack_axes=*/true);
  }
  TD_CHECK(false, "unknown controller");
}

Autopilot::Autopilot(const ControlParams& params, const ProcedureParams& procedure,
                     const VehicleModel& vehicle, const ClockParams& clock,
                     const ApproachParams& approach)
    : clock_(clock),
      vehicle_(vehicle),
      procedure_(procedure, clock, approach),
      levelling_(params.levelling),
      filter_(params.pose_filter(), clock),
      setpoint_(params.setpoint(), clock),
      controller_(MakeController(params, vehicle, clock)),
      allocation_(MakeAllocation(params, vehicle)),
      forces_(AsksForForces(params)) {
  if (!approach.on()) return;
  navigation_.emplace(
      NavigationLoop{.navigator = Navigator(approach.navigator, clock),
                     .setpoint = Setpoint(approach.pid.setpoint, clock),
                     .pid = Pid(approach.pid, vehicle, clock),
                     .allocation = ForceAllocation(approach.pid.allocation, vehicle)});
  if (approach.mode == ApproachMode::kPilot) navigation_->hand.emplace(approach, clock);
}

void Autopilot::SetControl(const ControlParams& params) {
  std::unique_ptr<Controller> controller = MakeController(params, vehicle_, clock_);
  std::unique_ptr<Allocation> allocation = MakeAllocation(params, vehicle_);
  PoseFilter filter(params.pose_filter(), clock_);
  setpoint_ = Setpoint(params.setpoint(), clock_);
  levelling_ = params.levelling;
  filter_ = filter;
  controller_ = std::move(controller);
  allocation_ = std::move(allocation);
  forces_ = AsksForForces(params);
  observed_ = false;
}

std::optional<AxesPose> Autopilot::navigated_MH() const {
  const std::optional<Navigated> now = navigation_ ? navigation_->navigator.pose() : std::nullopt;
  return now ? std::optional(now->pose_MH) : std::nullopt;
}

Outlook Autopilot::OutlookAt(const PoseEstimate& estimate,
                             const std::optional<NavigationReading>& reading) {
  Outlook outlook;
  if (navigation_) {
    navigation_->navigator.Update(estimate.frame, reading);
    outlook.navigated_MH = navigated_MH();
  }
  if (observed_ && procedure_.WouldGoBlind(estimate))
    if (const auto marker = controller_->Predict(estimate.frame))
      outlook.predicted_HM = ToAxesPose(*marker);
  return outlook;
}

// What the cameras say of navigation's error; nothing once a search has been in vain.
void Autopilot::CorrectNavigation(const PoseEstimate& estimate) {
  const Directive& d = *directive_;
  if (d.trusted && !IsBeforeFound(d.stage))
    navigation_->navigator.Correct(AxesPose::Of(estimate.X_HM));
  if (d.transition && d.transition->from == Stage::kSearch && d.stage == Stage::kApproach)
    navigation_->navigator.DropCorrection();
}

void Autopilot::Observe(const PoseEstimate& estimate) {
  TD_CHECK(estimate.X_HM.IsFinite(), "estimated pose must be finite");
  const auto seen = filter_.Update({.frame = estimate.frame,
                                    .position = ToAxes(estimate.X_HM),
                                    .rate = std::nullopt,
                                    .variance = VarianceOf(estimate)});
  if (!seen) return;
  controller_->Observe(*seen);
  observed_ = true;
}

ThrusterCommand Autopilot::Update(const PoseEstimate& estimate, const Excitation& excitation,
                                  const Attitude& attitude,
                                  const std::optional<NavigationReading>& reading) {
  const RollPitch level = LevellingMoment(levelling_, vehicle_, attitude);
  const Outlook outlook = OutlookAt(estimate, reading);
  uncorrected_MH_ = outlook.navigated_MH;
  directive_ = &procedure_.Update(estimate, outlook);
  demand_.setZero();
  if (directive_->trusted) Observe(estimate);
  if (navigation_) CorrectNavigation(estimate);
  if (directive_->control && directive_->guide == Guide::kNavigation)
    return SteerByNavigation(estimate.frame, excitation, level);
  if (navigation_) navigation_->setpoint.Restart();
  if (!directive_->control || !observed_) {
    setpoint_.Restart();
    controller_->OnCommandApplied(estimate.frame, Axes::Zero());
    const Axes share = ToAxes(directive_->open_loop) / kNeutralVolts + excitation.share;
    return allocation_->Share(allocation_->authority().cwiseProduct(share), level).command;
  }
  const Axes desired = ToAxes(directive_->desired) + excitation.wanted;
  const bool blind = directive_->guide == Guide::kPrediction;
  reference_ = setpoint_.Lead(estimate.frame, desired,
                              blind ? ToAxes(*outlook.predicted_HM) : ToAxes(estimate.X_HM));
  demand_ = controller_->Demand(reference_);
  const Axes added = allocation_->authority().cwiseProduct(excitation.share);
  const Allocated allocated = allocation_->Share(demand_ + added, level);
  controller_->OnCommandApplied(estimate.frame, allocated.given - added);
  return allocated.command;
}

ThrusterCommand Autopilot::SteerByNavigation(int64_t frame, const Excitation& excitation,
                                             const RollPitch& level) {
  NavigationLoop& loop = *navigation_;
  const Navigated now = *loop.navigator.pose();
  setpoint_.Restart();
  reference_ = loop.setpoint.Lead(frame, ToAxes(Inverse(directive_->desired)), ToAxes(now.pose_MH));
  loop.pid.Observe(SeenFrom(now, reference_, frame));
  demand_ = loop.pid.Demand({});
  const Axes authority = loop.allocation.authority(),
             added = authority.cwiseProduct(excitation.share);
  const Axes moved = loop.hand ? loop.hand->Move(frame, demand_, authority) : demand_;
  const Allocated allocated = loop.allocation.Share(moved + added, level);
  const Axes given = allocated.given - added;
  // A pilot knows what the sticks are moved by and does not wind up over it.
  loop.pid.OnCommandApplied(frame, loop.hand ? demand_ : given);
  controller_->OnCommandApplied(frame, forces_ ? given : Axes(Axes::Zero()));
  return allocated.command;
}

}  // namespace turbidock::control
