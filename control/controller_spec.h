#pragma once
// A controller as the autopilot takes it: how it is made, and what is done around it. SpecOf reads
// it off the controller's class T, which is made from (T::Params, VehicleModel, ClockParams) or
// without the latter: whether it predicts by whether T overrides Predict, the others by Params'
// members `pose_filter`, `setpoint` and `allocation`, where it has them.

#include <concepts>
#include <functional>
#include <memory>
#include <type_traits>
#include <variant>

#include "control/controller.h"
#include "control/pose_filter.h"
#include "control/setpoint.h"
#include "control/thrust_allocation.h"
#include "control/vehicle_model.h"
#include "sim/base/clock.h"
#include "sim/base/thruster_command.h"

namespace turbidock::control {

// What the thrusters are given, by the trial's time.
using CommandsOverTime = std::function<const ThrusterCommand&(double time_s)>;

struct ControllerSpec {
  // ConfigError for a vehicle that it cannot steer.
  std::function<std::unique_ptr<Controller>(const VehicleModel& vehicle, const ClockParams& clock)>
      make;
  bool predicts = false;  // where the marker is while it is not seen
  PoseFilterParams pose_filter{.enabled = false};
  SetpointParams setpoint{};
  std::variant<ForceAllocationParams, VoltsAllocationParams> allocation{};
  // Open loop: what the thrusters are given all the time, instead of what the controller asks for.
  // The vehicle may lack axes then.
  std::function<CommandsOverTime(const VehicleModel& vehicle, double duration_s)> commands{};

  bool asks_for_volts() const { return std::holds_alternative<VoltsAllocationParams>(allocation); }
};

namespace internal {
// A Predict that cannot be named from outside is one of its own.
template <class T>
concept InheritsPredict = requires {
  requires std::same_as<decltype(&T::Predict), decltype(&Controller::Predict)>;
};
}  // namespace internal

template <class T>
ControllerSpec SpecOf(const typename T::Params& params = {}) {
  using Params = typename T::Params;
  ControllerSpec spec;
  spec.make = [params]([[maybe_unused]] const VehicleModel& vehicle,
                       [[maybe_unused]] const ClockParams& clock) {
    if constexpr (std::constructible_from<T, const Params&, const VehicleModel&,
                                          const ClockParams&>)
      return std::make_unique<T>(params, vehicle, clock);
    else if constexpr (std::constructible_from<T, const Params&, const ClockParams&>)
      return std::make_unique<T>(params, clock);
    else
      return std::make_unique<T>(params);
  };
  spec.predicts = !internal::InheritsPredict<T>;
  if constexpr (requires { spec.pose_filter = params.pose_filter; })
    spec.pose_filter = params.pose_filter;
  if constexpr (requires { spec.setpoint = params.setpoint; }) spec.setpoint = params.setpoint;
  if constexpr (requires { spec.allocation = params.allocation; })
    spec.allocation = params.allocation;
  return spec;
}

}  // namespace turbidock::control
