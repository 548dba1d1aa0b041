#include "experiments/trial/plugins.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/config/yaml_fields.h"

namespace turbidock::trial {
namespace {

// Does what a plug-in is asked to, and names it where that fails.
template <class Do>
auto Guarded(const std::string& what, const Do& act) {
  try {
    return act();
  } catch (const PluginError&) {
    throw;
  } catch (const std::exception& error) {
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
    Guarded(At("Observe"), [&] { controller_->Observe(seen); });
  }
  control::Axes Demand(const control::Reference& wanted) override {
    const control::Axes demand = Guarded(At("Demand"), [&] { return controller_->Demand(wanted); });
    if (!demand.allFinite())
      throw PluginError(fmt::format("{} gave a demand that is not finite", At("Demand")));
    return demand;
  }
  void OnCommandApplied(int64_t frame, const control::Axes& given) override {
    Guarded(At("OnCommandApplied"), [&] { controller_->OnCommandApplied(frame, given); });
  }

 private:
  std::string At(const char* function) const {
    return fmt::format("{}, {} at frame {}", what_, function, frame_);
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

// Our choice, or one of `names`, whose choice is kept in `chosen`.
config::EnumRef Joined(const config::EnumRef& ours, const std::vector<std::string>& names,
                       std::string* chosen) {
  config::EnumRef both;
  both.names = ours.names;
  both.names.insert(both.names.end(), names.begin(), names.end());
  const size_t own = ours.names.size();
  both.get = [=] {
    const auto found = std::ranges::find(names, *chosen);
    return found == names.end() ? ours.get() : own + static_cast<size_t>(found - names.begin());
  };
  both.set = [=](size_t i) {
    *chosen = i < own ? "" : names[i - own];
    if (i < own) ours.set(i);
  };
  return both;
}

}  // namespace

template <class P>
auto Plugins::Kind<P>::Make(const std::string& name, const auto&... args) const {
  const auto found = std::ranges::find(all, name, &P::name);
  TD_CHECK(found != all.end(), "a plug-in of this name");
  return found->make(found->params, args...);
}

Plugins Plugins::WithDefaults() const {
  Plugins fresh = *this;
  const auto reset = [](auto* kind) {
    for (auto& plugin : kind->all) plugin.params = plugin.defaults;
    kind->chosen.clear();
  };
  reset(&fresh.controllers_);
  reset(&fresh.estimators_);
  return fresh;
}

void Plugins::RequireNewName(const std::string& name) const {
  if (name.empty() || !(name[0] >= 'a' && name[0] <= 'z') ||
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
    throw ConfigError("plug-in '" + name + "'",
                      "a name is of small letters, digits and underscores");
  for (const auto& taken : {controllers(), estimators()})
    if (std::ranges::find(taken, name) != taken.end())
      throw ConfigError("plug-in '" + name + "'", "there is one of this name already");
}

control::CustomController Plugins::Spec() const {
  const std::string& name = controller();
  control::CustomController controller = controllers_.Make(name);
  controller.make = [make = controller.make, name](const control::VehicleModel& vehicle,
                                                   const ClockParams& clock) {
    return std::make_unique<CheckedController>(
        name, Guarded("controller " + name + ", when made", [&] { return make(vehicle, clock); }));
  };
  return controller;
}

std::unique_ptr<vision::PoseEstimator> Plugins::MakeEstimator(const std::string& name,
                                                              const EstimatorSetup& setup) const {
  return std::make_unique<CheckedEstimator>(name, Guarded("estimator " + name + ", when made", [&] {
                                              return estimators_.Make(name, setup);
                                            }));
}

void Plugins::AddTo(config::GroupRef* scenario) {
  const auto add = [&](const std::string& choice, auto* kind, const std::string& what) {
    if (kind->all.empty()) return;
    const auto ours = std::ranges::find(scenario->fields, choice, &config::Field::key);
    ours->value = Joined(std::get<config::EnumRef>(ours->value), kind->Names(), &kind->chosen);
    for (auto& plugin : kind->all) {
      if (std::ranges::find(scenario->fields, plugin.name, &config::Field::key) !=
          scenario->fields.end())
        throw ConfigError("plug-in '" + plugin.name + "'", "a scenario has this key already");
      scenario->fields.push_back({plugin.name, Finite(), "a " + what + " of this program's own",
                                  plugin.group(&plugin.params)});
    }
  };
  add("controller", &controllers_, "controller");
  add("pose_estimator", &estimators_, "pose estimator");
}

void Plugins::Check() const {
  for (const auto& plugin : controllers_.all) plugin.check(plugin.params, plugin.name);
  for (const auto& plugin : estimators_.all) plugin.check(plugin.params, plugin.name);
}

}  // namespace turbidock::trial
