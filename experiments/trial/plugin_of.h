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
//   // control: {use: my_controller, my_controller: {gain_newton_per_m: 40}}
//
// What the autopilot does around it is read off the class: control/controller_spec.h. Without
// members of Params that say otherwise there is no filter and no lead, and it asks for forces. A
// Params may have `void CheckInUse(const std::string& path) const`: ConfigError for what would only
// be wrong if this one were chosen. An estimator is made from (Params, EstimatorSetup).

#include <concepts>
#include <memory>
#include <string>
#include <utility>

#include "experiments/config/yaml_fields.h"
#include "experiments/system/build_info.h"
#include "experiments/trial/plugins.h"
#include "sim/base/fields.h"

namespace turbidock::trial {

template <class Params, class Made, class... Args>
Plugins::Plugin<Made, Args...>* Plugins::Insert(
    Kind<Plugin<Made, Args...>>* kind, const std::string& name, const std::string& doc,
    bool has_keys, const Params& defaults,
    const std::function<Made(const Params&, Args...)>& make) {
  static const char kHere = 0;
  RequireNewName(name);
  if (kind->all.empty()) kind->chosen = name;
  return &kind->all.emplace_back(Plugin<Made, Args...>{
      .name = name,
      .doc = doc,
      .built_in = built_in_,
      .has_keys = has_keys,
      .code = built_in_ ? "" : system::CodeDigest(&kHere),
      .params = defaults,
      .defaults = defaults,
      .make = [make](const std::any& params,
                     Args... args) { return make(std::any_cast<const Params&>(params), args...); },
      .keys = [](std::any* params) { return config::GroupOf(std::any_cast<Params>(params)); },
      .check =
          [](const std::any& any, const std::string& path, [[maybe_unused]] bool in_use) {
            const auto& params = std::any_cast<const Params&>(any);
            CheckFields(params, path);
            if constexpr (requires { params.CheckInUse(path); })
              if (in_use) params.CheckInUse(path);
          }});
}

template <class Params>
void Plugins::AddController(
    const std::string& name, const Params& defaults,
    std::type_identity_t<std::function<control::ControllerSpec(const Params&)>> make,
    const std::string& doc) {
  Insert(&controllers_, name, doc, true, defaults, make);
}

template <class Params>
void Plugins::AddEstimator(
    const std::string& name, const Params& defaults,
    std::type_identity_t<
        std::function<std::unique_ptr<vision::PoseEstimator>(const Params&, const EstimatorSetup&)>>
        make,
    const EstimatorTraits& traits) {
  Insert(&estimators_, name, traits.doc, traits.has_keys, defaults, make)->scene = traits.scene;
}

template <class Controller>
void Plugins::AddController(const std::string& name, const std::string& doc) {
  using Params = typename Controller::Params;
  static_assert(std::derived_from<Controller, control::Controller> && HasFields<Params>,
                "a control::Controller with Params");
  AddController<Params>(name, {}, &control::SpecOf<Controller>, doc);
}

template <class Estimator>
void Plugins::AddEstimator(const std::string& name) {
  using Params = typename Estimator::Params;
  static_assert(std::derived_from<Estimator, vision::PoseEstimator> && HasFields<Params> &&
                    std::constructible_from<Estimator, const Params&, const EstimatorSetup&>,
                "a vision::PoseEstimator with Params, made from (Params, EstimatorSetup)");
  AddEstimator<Params>(name, {}, [](const Params& params, const EstimatorSetup& setup) {
    return std::make_unique<Estimator>(params, setup);
  });
}

}  // namespace turbidock::trial
