#pragma once
// Any class as a plug-in: what a program with a controller or an estimator of its own includes.
//
//   class MyController : public control::Controller {
//    public:
//     struct Params {
//       double gain_newton_per_m = 60;
//       static void Fields(auto& self, auto&& field) {
//         field("gain_newton_per_m", self.gain_newton_per_m, InRange(0, 1e3), "force a metre");
//       }
//     };
//     MyController(const Params& params, const control::VehicleModel& vehicle,
//                  const ClockParams& clock);
//     ...
//
//   Plugins plugins;
//   plugins.AddController<MyController>("my_controller");
//   // controller: my_controller, my_controller.gain_newton_per_m: 40
//
// If Params has members `pose_filter`, `setpoint` or `allocation` of the types that our controllers
// have (control/pid.h), the autopilot uses them; without, there is no filter and no lead. A
// controller asks for forces, unless its allocation is a VoltsAllocationParams, as the published
// controller's. It may do without the VehicleModel. An estimator is made from (Params,
// EstimatorSetup).

#include <concepts>
#include <memory>
#include <string>
#include <utility>

#include "experiments/config/yaml_fields.h"
#include "experiments/trial/plugins.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"

namespace turbidock::trial {

template <class Params, class Made, class... Args>
void Plugins::Insert(Kind<Plugin<Made, Args...>>* kind, const std::string& name,
                     const Params& defaults,
                     const std::function<Made(const Params&, Args...)>& make) {
  RequireNewName(name);
  const auto in = [](const std::any& params) -> const Params& {
    return *std::any_cast<Params>(&params);
  };
  kind->all.push_back(
      {name, defaults, defaults,
       [=](const std::any& params, Args... args) { return make(in(params), args...); },
       [](std::any* params) { return config::GroupOf(std::any_cast<Params>(params)); },
       [=](const std::any& params, const std::string& path) { CheckFields(in(params), path); }});
}

template <class Params>
void Plugins::AddController(
    const std::string& name, const Params& defaults,
    std::type_identity_t<std::function<control::CustomController(const Params&)>> make) {
  Insert(&controllers_, name, defaults, make);
}

template <class Params>
void Plugins::AddEstimator(
    const std::string& name, const Params& defaults,
    std::type_identity_t<
        std::function<std::unique_ptr<vision::PoseEstimator>(const Params&, const EstimatorSetup&)>>
        make) {
  Insert(&estimators_, name, defaults, make);
}

template <class ControllerType>
void Plugins::AddController(const std::string& name) {
  using Params = typename ControllerType::Params;
  constexpr bool kTakesVehicle =
      std::constructible_from<ControllerType, const Params&, const control::VehicleModel&,
                              const ClockParams&>;
  static_assert(std::derived_from<ControllerType, control::Controller> && HasFields<Params> &&
                    (kTakesVehicle ||
                     std::constructible_from<ControllerType, const Params&, const ClockParams&>),
                "a control::Controller with Params, made from (Params, VehicleModel, ClockParams)");
  AddController(name, Params(), [](const Params& params) {
    control::CustomController controller;
    controller.make = [params]([[maybe_unused]] const control::VehicleModel& vehicle,
                               const ClockParams& clock) {
      if constexpr (kTakesVehicle)
        return std::make_unique<ControllerType>(params, vehicle, clock);
      else
        return std::make_unique<ControllerType>(params, clock);
    };
    if constexpr (requires { controller.pose_filter = params.pose_filter; })
      controller.pose_filter = params.pose_filter;
    if constexpr (requires { controller.setpoint = params.setpoint; })
      controller.setpoint = params.setpoint;
    if constexpr (requires { controller.allocation = params.allocation; })
      controller.allocation = params.allocation;
    return controller;
  });
}

template <class Estimator>
void Plugins::AddEstimator(const std::string& name) {
  using Params = typename Estimator::Params;
  static_assert(std::derived_from<Estimator, vision::PoseEstimator> && HasFields<Params> &&
                    std::constructible_from<Estimator, const Params&, const EstimatorSetup&>,
                "a vision::PoseEstimator with Params, made from (Params, EstimatorSetup)");
  AddEstimator(name, Params(), [](const Params& params, const EstimatorSetup& setup) {
    return std::make_unique<Estimator>(params, setup);
  });
}

}  // namespace turbidock::trial
