#pragma once
// Control laws and pose estimators that are not part of turbidock: written in a program of one's
// own (plugin_of.h), chosen by `controller` and `pose_estimator`, with a group of keys under the
// plug-in's name. They are a value: the laws and estimators there are, which of them are chosen,
// and their parameters, copied with the scenario that they belong to.

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "control/autopilot.h"
#include "sim/base/camera.h"
#include "sim/base/random.h"
#include "vision/hue_labels.h"
#include "vision/marker_model.h"
#include "vision/pose_estimator.h"

namespace turbidock::config {
struct EnumRef;
struct GroupRef;
}  // namespace turbidock::config

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

// The parameters of one law or estimator.
class Plugin {
 public:
  virtual ~Plugin() = default;
  virtual config::GroupRef Group() = 0;                   // of its keys; refers into it
  virtual void Check(const std::string& path) const = 0;  // ConfigError
  virtual void Reset() = 0;                               // all keys have their defaults
};

class LawPlugin : public Plugin {
 public:
  virtual std::unique_ptr<LawPlugin> Copy() const = 0;
  virtual control::OwnLaw Law() const = 0;  // with the parameters as they are now
};

class EstimatorPlugin : public Plugin {
 public:
  virtual std::unique_ptr<EstimatorPlugin> Copy() const = 0;
  virtual std::unique_ptr<vision::PoseEstimator> Make(const EstimatorSetup& setup) const = 0;
};

class Plugins {
 public:
  Plugins() = default;
  Plugins(const Plugins& other);
  Plugins(Plugins&&) = default;
  Plugins& operator=(Plugins other) noexcept;
  ~Plugins() = default;

  // A class of one's own, see plugin_of.h. `name` is its group of keys in a scenario: small
  // letters, digits and underscores. ConfigError for a name that is taken or is none.
  template <class Law>
  void AddController(const std::string& name);
  template <class Estimator>
  void AddEstimator(const std::string& name);
  void Add(const std::string& name, std::unique_ptr<LawPlugin> law);
  void Add(const std::string& name, std::unique_ptr<EstimatorPlugin> estimator);

  // The same ones with their defaults, and none of them chosen.
  Plugins WithDefaults() const;

  // Names in the order in which they were added.
  std::vector<std::string> controllers() const;
  std::vector<std::string> estimators() const;
  bool empty() const { return laws_.empty() && estimators_.empty(); }

  // The chosen ones' names; empty: one of ours is chosen.
  const std::string& controller() const { return controller_; }
  const std::string& estimator() const { return estimator_; }

  // The chosen law. Whatever it throws, and a demand that is not finite, becomes a PluginError.
  control::OwnLaw Law() const;
  // An estimator of that name; likewise, for estimates that no estimator may give: a pose that is
  // not finite, a rotation that is none, a fitness outside [-1, 1].
  std::unique_ptr<vision::PoseEstimator> MakeEstimator(const std::string& name,
                                                       const EstimatorSetup& setup) const;

  // For Scenario: choices that have our names and the plug-ins', and the plug-ins' groups.
  config::EnumRef ControllerChoice(const config::EnumRef& ours);
  config::EnumRef EstimatorChoice(const config::EnumRef& ours);
  void AddGroups(config::GroupRef* scenario);
  void Check() const;

 private:
  template <class T>
  struct Named {
    std::string name;
    std::unique_ptr<T> plugin;
  };
  void RequireNewName(const std::string& name) const;
  const EstimatorPlugin& EstimatorNamed(const std::string& name) const;

  std::vector<Named<LawPlugin>> laws_;
  std::vector<Named<EstimatorPlugin>> estimators_;
  std::string controller_, estimator_;
};

}  // namespace turbidock::trial
