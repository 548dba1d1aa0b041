#include "control/autopilot.h"

#include <cmath>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

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

std::unique_ptr<Allocation> MakeAllocation(const ControllerSpec& controller,
                                           const VehicleModel& vehicle) {
  if (const auto* volts = std::get_if<VoltsAllocationParams>(&controller.allocation))
    return std::make_unique<VoltsAllocation>(*volts, vehicle);
  return std::make_unique<ForceAllocation>(std::get<ForceAllocationParams>(controller.allocation),
                                           vehicle,
                                           /*may_lack_axes=*/controller.commands != nullptr);
}

Autopilot::Autopilot(const ControlParams& params, const ProcedureParams& procedure,
                     const VehicleModel& vehicle, const ClockParams& clock,
                     const ApproachParams& approach)
    : clock_(clock),
      vehicle_(vehicle),
      procedure_(procedure, clock, approach),
      levelling_(params.levelling),
      filter_(params.controller.pose_filter, clock),
      setpoint_(params.controller.setpoint, clock),
      controller_(params.controller.make(vehicle, clock)),
      allocation_(MakeAllocation(params.controller, vehicle)),
      forces_(!params.controller.asks_for_volts()) {
  if (!approach.on()) return;
  navigation_.emplace(
      NavigationLoop{.navigator = Navigator(approach.navigator, clock),
                     .setpoint = Setpoint(approach.controller.setpoint, clock),
                     .controller = Pid(approach.controller, vehicle, clock),
                     .allocation = ForceAllocation(approach.controller.allocation, vehicle)});
  if (approach.mode == ApproachMode::kPilot) navigation_->hand.emplace(approach, clock);
}

void Autopilot::SetControl(const ControlParams& params) {
  const ControllerSpec& spec = params.controller;
  std::unique_ptr<Controller> controller = spec.make(vehicle_, clock_);
  std::unique_ptr<Allocation> allocation = MakeAllocation(spec, vehicle_);
  PoseFilter filter(spec.pose_filter, clock_);
  setpoint_ = Setpoint(spec.setpoint, clock_);
  levelling_ = params.levelling;
  filter_ = filter;
  controller_ = std::move(controller);
  allocation_ = std::move(allocation);
  forces_ = !spec.asks_for_volts();
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

void Autopilot::Observe(const PoseEstimate& estimate, const Attitude& attitude,
                        const std::optional<NavigationReading>& reading) {
  TD_CHECK(estimate.X_HM.IsFinite(), "estimated pose must be finite");
  auto seen = filter_.Update({.frame = estimate.frame,
                              .position = ToAxes(estimate.X_HM),
                              .rate = std::nullopt,
                              .variance = VarianceOf(estimate)});
  if (!seen) return;
  seen->fitness = estimate.fitness;
  seen->attitude = attitude;
  seen->navigation = reading;
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
  if (directive_->trusted) Observe(estimate, attitude, reading);
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
  if (const ThrusterCommand* own = controller_->Command()) {
    if (!excitation.share.isZero(0))
      throw ConfigError("control.use", "commands each thruster: nothing can be added on an axis");
    controller_->OnCommandApplied(estimate.frame, demand_);
    return *own;
  }
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
  loop.controller.Observe(SeenFrom(now, reference_, frame));
  demand_ = loop.controller.Demand({});
  const Axes authority = loop.allocation.authority(),
             added = authority.cwiseProduct(excitation.share);
  const Axes moved = loop.hand ? loop.hand->Move(frame, demand_, authority) : demand_;
  const Allocated allocated = loop.allocation.Share(moved + added, level);
  const Axes given = allocated.given - added;
  // A pilot knows what the sticks are moved by and does not wind up over it.
  loop.controller.OnCommandApplied(frame, loop.hand ? demand_ : given);
  controller_->OnCommandApplied(frame, forces_ ? given : Axes(Axes::Zero()));
  return allocated.command;
}

}  // namespace turbidock::control
