#include "experiments/trial/plugins.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/config/nearest_name.h"
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

class CheckedLaw final : public control::Controller {
 public:
  CheckedLaw(std::string name, std::unique_ptr<control::Controller> law)
      : what_("controller " + std::move(name)), law_(std::move(law)) {
    if (!law_) throw PluginError(what_ + " was not made");
  }

  void Observe(const control::Observation& seen) override {
    frame_ = seen.frame;
    Guarded(At("Observe"), [&] { law_->Observe(seen); });
  }
  control::Axes Demand(const control::Reference& wanted) override {
    const control::Axes demand = Guarded(At("Demand"), [&] { return law_->Demand(wanted); });
    if (!demand.allFinite())
      throw PluginError(fmt::format("{} gave a demand that is not finite", At("Demand")));
    return demand;
  }
  void Given(int64_t frame, const control::Axes& given) override {
    Guarded(At("Given"), [&] { law_->Given(frame, given); });
  }

 private:
  std::string At(const char* function) const {
    return fmt::format("{}, {} at frame {}", what_, function, frame_);
  }

  std::string what_;
  std::unique_ptr<control::Controller> law_;
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
  std::optional<StereoRegion> Reach() const override {
    return Guarded("estimator " + name_ + ", Reach", [&] { return estimator_->Reach(); });
  }
  std::string_view name() const override { return name_; }

 private:
  std::string name_;
  std::unique_ptr<vision::PoseEstimator> estimator_;
  PoseEstimate estimate_;
};

template <class List>
std::vector<std::string> NamesIn(const List& list) {
  std::vector<std::string> names;
  for (const auto& entry : list) names.push_back(entry.name);
  return names;
}

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
    if (i < own) {
      chosen->clear();
      ours.set(i);
    } else {
      *chosen = names[i - own];
    }
  };
  return both;
}

}  // namespace

Plugins::Plugins(const Plugins& other)
    : controller_(other.controller_), estimator_(other.estimator_) {
  for (const auto& [name, plugin] : other.laws_) laws_.push_back({name, plugin->Copy()});
  for (const auto& [name, plugin] : other.estimators_)
    estimators_.push_back({name, plugin->Copy()});
}

Plugins& Plugins::operator=(Plugins other) noexcept {
  laws_.swap(other.laws_);
  estimators_.swap(other.estimators_);
  controller_.swap(other.controller_);
  estimator_.swap(other.estimator_);
  return *this;
}

Plugins Plugins::WithDefaults() const {
  Plugins fresh = *this;
  for (const auto& [name, plugin] : fresh.laws_) plugin->Reset();
  for (const auto& [name, plugin] : fresh.estimators_) plugin->Reset();
  fresh.controller_.clear();
  fresh.estimator_.clear();
  return fresh;
}

void Plugins::RequireNewName(const std::string& name) const {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  };
  if (name.empty() || !(name[0] >= 'a' && name[0] <= 'z') || !std::ranges::all_of(name, allowed))
    throw ConfigError("plug-in '" + name + "'",
                      "a name is of small letters, digits and underscores");
  std::vector<std::string> taken = NamesIn(laws_);
  for (const std::string& other : NamesIn(estimators_)) taken.push_back(other);
  if (std::ranges::find(taken, name) != taken.end())
    throw ConfigError("plug-in '" + name + "'", "there is one of this name already");
}

void Plugins::Add(const std::string& name, std::unique_ptr<LawPlugin> law) {
  RequireNewName(name);
  laws_.push_back({name, std::move(law)});
}

void Plugins::Add(const std::string& name, std::unique_ptr<EstimatorPlugin> estimator) {
  RequireNewName(name);
  estimators_.push_back({name, std::move(estimator)});
}

std::vector<std::string> Plugins::controllers() const { return NamesIn(laws_); }
std::vector<std::string> Plugins::estimators() const { return NamesIn(estimators_); }

control::OwnLaw Plugins::Law() const {
  const auto found = std::ranges::find(laws_, controller_, &Named<LawPlugin>::name);
  TD_CHECK(found != laws_.end(), "a law of the program's own is chosen");
  control::OwnLaw law = found->plugin->Law();
  law.make = [make = law.make, name = controller_](const control::VehicleModel& vehicle,
                                                   const ClockParams& clock) {
    return std::make_unique<CheckedLaw>(
        name, Guarded("controller " + name + ", when made", [&] { return make(vehicle, clock); }));
  };
  return law;
}

const EstimatorPlugin& Plugins::EstimatorNamed(const std::string& name) const {
  const auto found = std::ranges::find(estimators_, name, &Named<EstimatorPlugin>::name);
  TD_CHECK(found != estimators_.end(), "an estimator of the program's own");
  return *found->plugin;
}

std::unique_ptr<vision::PoseEstimator> Plugins::MakeEstimator(const std::string& name,
                                                              const EstimatorSetup& setup) const {
  const EstimatorPlugin& plugin = EstimatorNamed(name);
  return std::make_unique<CheckedEstimator>(
      name, Guarded("estimator " + name + ", when made", [&] { return plugin.Make(setup); }));
}

config::EnumRef Plugins::ControllerChoice(const config::EnumRef& ours) {
  return Joined(ours, controllers(), &controller_);
}

config::EnumRef Plugins::EstimatorChoice(const config::EnumRef& ours) {
  return Joined(ours, estimators(), &estimator_);
}

void Plugins::AddGroups(config::GroupRef* scenario) {
  const auto add = [&](const std::string& name, Plugin* plugin, const char* doc) {
    for (const config::Field& field : scenario->fields)
      if (field.key == name)
        throw ConfigError("plug-in '" + name + "'", "a scenario has this key already");
    scenario->fields.push_back({name, Finite(), doc, plugin->Group()});
  };
  for (const auto& [name, plugin] : laws_)
    add(name, plugin.get(), "a control law of this program's own");
  for (const auto& [name, plugin] : estimators_)
    add(name, plugin.get(), "a pose estimator of this program's own");
}

void Plugins::Check() const {
  for (const auto& [name, plugin] : laws_) plugin->Check(name);
  for (const auto& [name, plugin] : estimators_) plugin->Check(name);
}

}  // namespace turbidock::trial
