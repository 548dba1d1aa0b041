#pragma once
// Controllers and pose estimators that are not part of turbidock: written in a program of one's
// own (plugin_of.h), chosen by `controller` and `pose_estimator`, with a group of keys under the
// plug-in's name. They are a value: the controllers and estimators there are, which of them are
// chosen, and their parameters, copied with the scenario that they belong to.

#include <any>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "control/autopilot.h"
#include "experiments/config/group_ref.h"
#include "sim/base/camera.h"
#include "sim/base/random.h"
#include "vision/hue_labels.h"
#include "vision/marker_model.h"
#include "vision/pose_estimator.h"

namespace turbidock::trial {

// What an estimator is made from, besides its own parameters.
struct EstimatorSetup {
  vision::MarkerParams marker;
  vision::HueParams hue;
  StereoRig rig;
  Rng rng;  // a stream of its own: the same trial draws the same numbers
};

// A plug-in threw, or returned what no plug-in may: names it. In a batch the trial's outcome is
// `crashed`.
struct PluginError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Plugins {
 public:
  // A class of one's own, see plugin_of.h. `name` is its group of keys in a scenario: small
  // letters, digits and underscores. ConfigError for a name that is taken or is none.
  template <class ControllerType>
  void AddController(const std::string& name);
  template <class Estimator>
  void AddEstimator(const std::string& name);

  // The same of any parameters with Fields, and of what makes a controller or an estimator of them.
  template <class Params>
  void AddController(
      const std::string& name, const Params& defaults,
      std::type_identity_t<std::function<control::CustomController(const Params&)>> make);
  template <class Params>
  void AddEstimator(const std::string& name, const Params& defaults,
                    std::type_identity_t<std::function<std::unique_ptr<vision::PoseEstimator>(
                        const Params&, const EstimatorSetup&)>>
                        make);

  // The same ones with their defaults, and none of them chosen.
  Plugins WithDefaults() const;

  // A line of kind, name and a digest of its code for each.
  std::string Code() const { return ""; }

  // Names in the order in which they were added.
  std::vector<std::string> controllers() const { return controllers_.Names(); }
  std::vector<std::string> estimators() const { return estimators_.Names(); }

  // The chosen ones' names; empty: one of ours is chosen.
  const std::string& controller() const { return controllers_.chosen; }
  const std::string& estimator() const { return estimators_.chosen; }

  // The chosen controller. Whatever it throws, and a demand that is not finite, becomes a
  // PluginError.
  control::CustomController Spec() const;
  // An estimator of that name; likewise, for estimates that no estimator may give: a pose that is
  // not finite, a rotation that is none, a fitness outside [-1, 1].
  std::unique_ptr<vision::PoseEstimator> MakeEstimator(const std::string& name,
                                                       const EstimatorSetup& setup) const;

  // Makes them choices of `controller` and `pose_estimator` in a scenario's group of keys, and adds
  // their own groups.
  void AddTo(config::GroupRef* scenario);
  void Check() const;  // ConfigError

 private:
  // Parameters of any type, what is made of them as they are now, and what is done with them.
  template <class Made, class... Args>
  struct Plugin {
    std::string name;
    std::any params, defaults;
    std::function<Made(const std::any&, Args...)> make;
    std::function<config::GroupRef(std::any*)> group;  // of its keys; refers into the parameters
    std::function<void(const std::any&, const std::string& path)> check;
  };
  template <class P>
  struct Kind {
    std::vector<P> all;
    std::string chosen;

    std::vector<std::string> Names() const {
      std::vector<std::string> names;
      for (const P& each : all) names.push_back(each.name);
      return names;
    }
    auto Make(const std::string& name, const auto&... args) const;
  };
  template <class Params, class Made, class... Args>
  void Insert(Kind<Plugin<Made, Args...>>* kind, const std::string& name, const Params& defaults,
              const std::function<Made(const Params&, Args...)>& make);
  void RequireNewName(const std::string& name) const;

  Kind<Plugin<control::CustomController>> controllers_;
  Kind<Plugin<std::unique_ptr<vision::PoseEstimator>, const EstimatorSetup&>> estimators_;
};

}  // namespace turbidock::trial
