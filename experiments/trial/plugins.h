#pragma once
// The controllers and pose estimators that a scenario may choose by `control.use` and
// `estimator.use`, each with a group of keys beside it, `control.NAME` or `estimator.NAME`:
// turbidock's own (built_in.cc) and those of a program of one's own (plugin_of.h), registered
// alike. They are a value: which there are, which of them are chosen, and their parameters, copied
// with the scenario that they belong to.

#include <algorithm>
#include <any>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <vector>

#include "control/controller_spec.h"
#include "experiments/config/group_ref.h"
#include "sim/base/camera.h"
#include "sim/base/check.h"
#include "sim/base/image_times.h"
#include "sim/base/random.h"
#include "vision/hue_labels.h"
#include "vision/marker_model.h"
#include "vision/pose_estimator.h"

namespace turbidock::vehicle {
struct Scene;
}

namespace turbidock::trial {

struct Scenario;

// What an estimator is made from, besides its own parameters.
struct EstimatorSetup {
  vision::MarkerParams marker;
  vision::HueParams hue;
  StereoRig rig;
  Rng rng;  // a stream of its own: the same trial draws the same numbers
  ImageTimes images{};
};

// A plug-in threw, or returned what no plug-in may: names it. In a batch the trial's outcome is
// `crashed`.
struct PluginError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A plug-in that stands for another program got no answer from it: nothing is known of docking. In
// a batch the trial's outcome is `no_answer`.
struct NoAnswer : PluginError {
  using PluginError::PluginError;
};

// Begins the code of a plug-in whose code cannot be told.
inline constexpr const char* kUnknownCode = "unknown-";

// For an estimator with parameters that say what is in the scene: whether they are to be taken from
// there, what does so (without a scene: knows nothing of it), what throws ConfigError where the
// scene is not as they say, and the keys that say whether and what.
struct SceneHooks {
  bool (*takes)(const Scenario&) = nullptr;
  void (*take)(const vehicle::Scene*, Scenario*) = nullptr;
  void (*check)(const Scenario&, const vehicle::Scene&) = nullptr;
  std::string flag{}, part{};
};
// What else may be said of an estimator.
struct EstimatorTraits {
  std::string doc = "a pose estimator of this program's own";
  bool has_keys = true;  // in a scenario
  SceneHooks scene{};
};

class Plugins {
 public:
  Plugins();  // turbidock's own; the first of them are chosen

  // A class of one's own, see plugin_of.h. `name` is its group of keys in a scenario, below
  // `control` or `estimator`: small letters, digits and underscores. ConfigError for a name that is
  // taken or is none.
  template <class Controller>
  void AddController(const std::string& name,
                     const std::string& doc = "a controller of this program's own");
  template <class Estimator>
  void AddEstimator(const std::string& name);

  // The same of any parameters with Fields, and of what makes a controller or an estimator of them.
  template <class Params>
  void AddController(
      const std::string& name, const Params& defaults,
      std::type_identity_t<std::function<control::ControllerSpec(const Params&)>> make,
      const std::string& doc = "a controller of this program's own");
  template <class Params>
  void AddEstimator(const std::string& name, const Params& defaults,
                    std::type_identity_t<std::function<std::unique_ptr<vision::PoseEstimator>(
                        const Params&, const EstimatorSetup&)>>
                        make,
                    const EstimatorTraits& traits = {});

  // Which program has them, as whoever types a command calls it.
  const std::string& program() const { return program_; }
  void SetProgram(const std::string& name) { program_ = name; }

  // The same ones with their defaults, and the first of them chosen.
  Plugins WithDefaults() const;

  // A line of name and code for each of the chosen ones that is not turbidock's own: what a trial's
  // result follows from besides the scenario and the program. The code is a digest of the program
  // or library that registered it, or what SetCode says.
  std::string CodeInUse() const;
  void SetCode(const std::string& name, const std::string& code);

  // Names in the order in which they were added.
  std::vector<std::string> controllers() const { return controllers_.Names(); }
  std::vector<std::string> estimators() const { return estimators_.Names(); }

  // The chosen ones' names.
  const std::string& controller() const { return controllers_.chosen; }
  const std::string& estimator() const { return estimators_.chosen; }

  // The parameters of this type, which the first one that has such is made from.
  template <class Params>
  const Params& ParamsOf() const {
    return std::any_cast<const Params&>(Find(typeid(Params)));
  }
  template <class Params>
  Params& ParamsOf() {
    return const_cast<Params&>(std::as_const(*this).ParamsOf<Params>());
  }

  // The chosen controller, or that of a name. Whatever a program's own throws, and a demand or a
  // prediction that is not finite, becomes a PluginError; a ConfigError when it is made goes on.
  control::ControllerSpec Spec() const { return Spec(controller()); }
  control::ControllerSpec Spec(const std::string& name) const;
  // An estimator of that name; likewise, for estimates that no estimator may give: a pose that is
  // not finite, a rotation that is none, a fitness outside [-1, 1].
  std::unique_ptr<vision::PoseEstimator> MakeEstimator(const std::string& name,
                                                       const EstimatorSetup& setup) const;

  // The chosen estimator's; those of all that have some.
  const SceneHooks& scene_hooks() const { return estimators_.Named(estimator()).scene; }
  std::vector<SceneHooks> all_scene_hooks() const;

  // Adds `control.use`, `estimator.use` and the group of each to a scenario's keys.
  void AddTo(config::GroupRef* scenario);
  void Check() const;  // ConfigError

 private:
  // Parameters of any type, what is made of them as they are now, and what is done with them.
  template <class Made, class... Args>
  struct Plugin {
    std::string name, doc;
    bool built_in, has_keys;
    std::string code;  // of the program that registered it, or what SetCode says
    std::any params, defaults;
    std::function<Made(const std::any&, Args...)> make;
    std::function<config::GroupRef(std::any*)> keys;  // refers into the parameters
    std::function<void(const std::any&, const std::string& path, bool in_use)> check;
    SceneHooks scene{};

    std::string CodeLine() const;
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
    const P& Named(const std::string& name) const {
      const auto found = std::ranges::find(all, name, &P::name);
      TD_CHECK(found != all.end(), "one of this name");
      return *found;
    }
  };
  template <class Params, class Made, class... Args>
  Plugin<Made, Args...>* Insert(Kind<Plugin<Made, Args...>>* kind, const std::string& name,
                                const std::string& doc, bool has_keys, const Params& defaults,
                                const std::function<Made(const Params&, Args...)>& make);
  void RequireNewName(const std::string& name) const;
  const std::any& Find(const std::type_info& params) const;

  std::string program_ = "turbidock";
  bool built_in_ = true;  // what is added now
  Kind<Plugin<control::ControllerSpec>> controllers_;
  Kind<Plugin<std::unique_ptr<vision::PoseEstimator>, const EstimatorSetup&>> estimators_;
};

}  // namespace turbidock::trial
