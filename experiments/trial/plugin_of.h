#pragma once
// Any class as a plug-in: what a program with a law or an estimator of its own includes.
//
//   class MyLaw : public control::Controller {
//    public:
//     struct Params {
//       double gain_newton_per_m = 60;
//       static void Fields(auto& self, auto&& field) {
//         field("gain_newton_per_m", self.gain_newton_per_m, InRange(0, 1e3), "force a metre");
//       }
//     };
//     MyLaw(const Params& params, const control::VehicleModel& vehicle, const ClockParams& clock);
//     ...
//
//   Plugins plugins;
//   plugins.AddController<MyLaw>("my_law");  // controller: my_law, my_law.gain_newton_per_m: 40
//
// If Params has members `pose_filter`, `setpoint` or `allocation` of the types that our laws have
// (control/pid.h), the autopilot uses them; without, there is no filter and no lead. A law asks for
// forces, unless its allocation is a VoltsAllocationParams, as the published law's. It may do
// without the VehicleModel. An estimator is made from (Params, EstimatorSetup).

#include <concepts>
#include <memory>
#include <string>
#include <type_traits>

#include "experiments/config/yaml_fields.h"
#include "experiments/trial/plugins.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"

namespace turbidock::trial {

template <class T>
concept HasParams = HasFields<typename T::Params> && std::copyable<typename T::Params> &&
    std::default_initializable<typename T::Params>;

template <class T>
concept OwnController = std::derived_from<T, control::Controller> && HasParams<T> &&
    (std::constructible_from<T, const typename T::Params&, const control::VehicleModel&,
                             const ClockParams&> ||
     std::constructible_from<T, const typename T::Params&, const ClockParams&>);

template <class T>
concept OwnEstimator = std::derived_from<T, vision::PoseEstimator> && HasParams<T> &&
    std::constructible_from<T, const typename T::Params&, const EstimatorSetup&>;

template <OwnController L>
class LawPluginOf final : public LawPlugin {
 public:
  config::GroupRef Group() override { return config::GroupOf(&params_); }
  void Check(const std::string& path) const override { CheckFields(params_, path); }
  void Reset() override { params_ = {}; }
  std::unique_ptr<LawPlugin> Copy() const override { return std::make_unique<LawPluginOf>(*this); }
  control::OwnLaw Law() const override {
    control::OwnLaw law;
    law.make = [params = params_]([[maybe_unused]] const control::VehicleModel& vehicle,
                                  const ClockParams& clock) {
      if constexpr (std::constructible_from<L, const typename L::Params&,
                                            const control::VehicleModel&, const ClockParams&>)
        return std::make_unique<L>(params, vehicle, clock);
      else
        return std::make_unique<L>(params, clock);
    };
    if constexpr (requires { law.pose_filter = params_.pose_filter; })
      law.pose_filter = params_.pose_filter;
    if constexpr (requires { law.setpoint = params_.setpoint; }) law.setpoint = params_.setpoint;
    if constexpr (requires { law.allocation = params_.allocation; })
      law.allocation = params_.allocation;
    return law;
  }

 private:
  typename L::Params params_;
};

template <OwnEstimator E>
class EstimatorPluginOf final : public EstimatorPlugin {
 public:
  config::GroupRef Group() override { return config::GroupOf(&params_); }
  void Check(const std::string& path) const override { CheckFields(params_, path); }
  void Reset() override { params_ = {}; }
  std::unique_ptr<EstimatorPlugin> Copy() const override {
    return std::make_unique<EstimatorPluginOf>(*this);
  }
  std::unique_ptr<vision::PoseEstimator> Make(const EstimatorSetup& setup) const override {
    return std::make_unique<E>(params_, setup);
  }

 private:
  typename E::Params params_;
};

template <class Law>
void Plugins::AddController(const std::string& name) {
  static_assert(OwnController<Law>,
                "a control::Controller with Params, made from (Params, VehicleModel, ClockParams)");
  Add(name, std::make_unique<LawPluginOf<Law>>());
}

template <class Estimator>
void Plugins::AddEstimator(const std::string& name) {
  static_assert(OwnEstimator<Estimator>,
                "a vision::PoseEstimator with Params, made from (Params, EstimatorSetup)");
  Add(name, std::make_unique<EstimatorPluginOf<Estimator>>());
}

}  // namespace turbidock::trial
