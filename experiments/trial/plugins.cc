#include "experiments/trial/plugins.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/config/yaml_fields.h"
#include "experiments/trial/scenario.h"

namespace turbidock::trial {
namespace {

// Does what a plug-in is asked to, and names it where that fails. One that `may_refuse` does so by
// a ConfigError.
template <class Do>
auto Guarded(const std::string& what, const Do& act, bool may_refuse = false) {
  try {
    return act();
  } catch (const PluginError&) {
    throw;
  } catch (const std::exception& error) {
    if (may_refuse && dynamic_cast<const ConfigError*>(&error)) throw;
    throw PluginError(what + ": " + error.what());
  } catch (...) {
    throw PluginError(what + " threw what is no std::exception");
  }
}

class CheckedController final : public control::Controller {
 public:
  CheckedController(std::string name, std::unique_ptr<control::Controller> controller)
      : what_("controller " + std::move(name)), controller_(std::move(controller)) {
    if (!controller_) throw PluginError(what_ + " was not made");
  }

  void Observe(const control::Observation& seen) override {
    frame_ = seen.frame;
    Guarded(At("Observe", frame_), [&] { controller_->Observe(seen); });
  }
  control::Axes Demand(const control::Reference& wanted) override {
    const std::string what = At("Demand", frame_);
    control::Axes demand = Guarded(what, [&] { return controller_->Demand(wanted); });
    if (!demand.allFinite()) throw PluginError(what + " gave a demand that is not finite");
    return demand;
  }
  const ThrusterCommand* Command() const override { return controller_->Command(); }
  std::optional<control::Axes> Predict(int64_t frame) override {
    const std::string what = At("Predict", frame);
    auto marker = Guarded(what, [&] { return controller_->Predict(frame); });
    if (marker && !marker->allFinite())
      throw PluginError(what + " gave a prediction that is not finite");
    return marker;
  }
  void OnCommandApplied(int64_t frame, const control::Axes& given) override {
    Guarded(At("OnCommandApplied", frame_), [&] { controller_->OnCommandApplied(frame, given); });
  }

 private:
  std::string At(const char* function, int64_t frame) const {
    return fmt::format("{}, {} at frame {}", what_, function, frame);
  }

  std::string what_;
  std::unique_ptr<control::Controller> controller_;
  int64_t frame_ = 0;
};

class CheckedEstimator final : public vision::PoseEstimator {
 public:
  CheckedEstimator(std::string name, std::unique_ptr<vision::PoseEstimator> estimator)
      : name_(std::move(name)), estimator_(std::move(estimator)) {
    if (!estimator_) throw PluginError("estimator " + name_ + " was not made");
  }

  const PoseEstimate& Update(const StereoImage& seen) override {
    const std::string what = fmt::format("estimator {}, Update at frame {}", name_, seen.frame);
    estimator_->set_timer(timer());
    estimate_ = Guarded(what, [&]() -> const PoseEstimate& { return estimator_->Update(seen); });
    estimate_.frame = seen.frame;
    if (!estimate_.X_HM.IsFinite()) throw PluginError(what + " gave a pose that is not finite");
    constexpr double kTol = 1e-3;
    const double norm = estimate_.X_HM.q.norm();
    if (std::abs(norm - 1) > kTol)
      throw PluginError(fmt::format("{} gave a quaternion of length {:g}", what, norm));
    if (!(std::abs(estimate_.fitness) <= 1))
      throw PluginError(
          fmt::format("{} gave a fitness of {:g}, must be in [-1, 1]", what, estimate_.fitness));
    if (norm != 1) estimate_.X_HM.q.normalize();
    estimate_.X_HM = estimate_.X_HM.Canonical();
    return estimate_;
  }
  void Reset() override {
    Guarded("estimator " + name_ + ", Reset", [&] { estimator_->Reset(); });
  }
  std::optional<StereoRegion> RegionOfInterest() const override {
    return Guarded("estimator " + name_ + ", RegionOfInterest",
                   [&] { return estimator_->RegionOfInterest(); });
  }
  std::string_view name() const override { return name_; }

 private:
  std::string name_;
  std::unique_ptr<vision::PoseEstimator> estimator_;
  PoseEstimate estimate_;
};

// One of `names`, kept in `chosen`.
config::EnumRef ChoiceOf(const std::vector<std::string>& names, std::string* chosen) {
  return {names,
          [=] { return static_cast<size_t>(std::ranges::find(names, *chosen) - names.begin()); },
          [=](size_t i) { *chosen = names[i]; }};
}

}  // namespace

const std::any& Plugins::Find(const std::type_info& params) const {
  for (const auto& each : controllers_.all)
    if (each.params.type() == params) return each.params;
  for (const auto& each : estimators_.all)
    if (each.params.type() == params) return each.params;
  TD_CHECK(false, "parameters of a controller or an estimator");
}

Plugins Plugins::WithDefaults() const {
  Plugins fresh = *this;
  const auto reset = [](auto* kind) {
    for (auto& plugin : kind->all) plugin.params = plugin.defaults;
    kind->chosen = kind->all.front().name;
  };
  reset(&fresh.controllers_);
  reset(&fresh.estimators_);
  return fresh;
}

template <class Made, class... Args>
std::string Plugins::Plugin<Made, Args...>::CodeLine() const {
  if (built_in) return "";
  return name + " " + code + "\n";
}

std::string Plugins::CodeInUse() const {
  return controllers_.Named(controller()).CodeLine() + estimators_.Named(estimator()).CodeLine();
}

void Plugins::SetCode(const std::string& name, const std::string& code) {
  for (auto& plugin : controllers_.all)
    if (plugin.name == name) plugin.code = code;
  for (auto& plugin : estimators_.all)
    if (plugin.name == name) plugin.code = code;
}

void Plugins::RequireNewName(const std::string& name) const {
  if (name.empty() || !(name[0] >= 'a' && name[0] <= 'z') ||
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
    throw ConfigError("plug-in '" + name + "'",
                      "a name is of small letters, digits and underscores");
  for (const auto& taken : {controllers(), estimators()})
    if (std::ranges::find(taken, name) != taken.end())
      throw ConfigError("plug-in '" + name + "'", "there is one of this name already");
  if (built_in_) return;
  Scenario any;
  for (const config::Field& group : config::GroupOf(&any).fields)
    if (group.key == "control" || group.key == "estimator") {
      const auto& keys = std::get<config::GroupRef>(group.value).fields;
      if (std::ranges::find(keys, name, &config::Field::key) != keys.end())
        throw ConfigError("plug-in '" + name + "'", "there is a key " + group.key + "." + name);
    }
}

control::ControllerSpec Plugins::Spec(const std::string& name) const {
  const auto& plugin = controllers_.Named(name);
  control::ControllerSpec spec = plugin.make(plugin.params);
  if (plugin.built_in) return spec;
  spec.make = [make = spec.make, name](const control::VehicleModel& vehicle,
                                       const ClockParams& clock) {
    return std::make_unique<CheckedController>(
        name, Guarded(
                  "controller " + name + ", when made", [&] { return make(vehicle, clock); },
                  /*may_refuse=*/true));
  };
  return spec;
}

std::unique_ptr<vision::PoseEstimator> Plugins::MakeEstimator(const std::string& name,
                                                              const EstimatorSetup& setup) const {
  const auto& plugin = estimators_.Named(name);
  if (plugin.built_in) return plugin.make(plugin.params, setup);
  return std::make_unique<CheckedEstimator>(
      name,
      Guarded(
          "estimator " + name + ", when made", [&] { return plugin.make(plugin.params, setup); },
          /*may_refuse=*/true));
}

std::vector<SceneHooks> Plugins::all_scene_hooks() const {
  std::vector<SceneHooks> hooks;
  for (const auto& plugin : estimators_.all)
    if (plugin.scene.takes) hooks.push_back(plugin.scene);
  return hooks;
}

void Plugins::AddTo(config::GroupRef* scenario) {
  const auto add = [scenario](const std::string& group, const char* doc, auto* kind) {
    const auto add_key = [&](const std::string& key, const char* about, config::ValueRef value) {
      config::internal::AddField((group + "." + key).c_str(), Finite(), about, std::move(value),
                                 scenario);
    };
    add_key("use", doc, ChoiceOf(kind->Names(), &kind->chosen));
    for (auto& plugin : kind->all)
      if (plugin.has_keys) add_key(plugin.name, plugin.doc.c_str(), plugin.keys(&plugin.params));
  };
  add("estimator", "estimator that finds the marker in the images", &estimators_);
  add("control", "controller that steers by the estimate", &controllers_);
}

void Plugins::Check() const {
  const auto check = [](const std::string& group, const auto& kind) {
    for (const auto& plugin : kind.all)
      plugin.check(plugin.params, JoinKey(group, plugin.name), plugin.name == kind.chosen);
  };
  check("estimator", estimators_);
  check("control", controllers_);
}

}  // namespace turbidock::trial
