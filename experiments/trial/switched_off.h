#pragma once
// Keys that change no trial because another key is as it is.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "experiments/trial/scenario.h"

namespace turbidock::trial {

// "water.background = pure": what has this key, or all of this group, change no trial of the
// scenario. Empty where it may change one: choices, switches and amounts of nothing are known here,
// values that merely happen not to matter are not.
std::string SwitchedOffBy(const Scenario& scenario, const std::string& key);

// Over one scenario or more: which of the keys that were named (config::GivenKeys) change none.
class IdleKeys {
 public:
  // `sees_images`: whether images are looked at, also of trials on the true pose.
  explicit IdleKeys(bool sees_images = false) : sees_images_(sees_images) {}

  void Look(const Scenario& scenario);
  // "water.asymmetry changes no trial: water.background = pure", by key.
  std::vector<std::string> Remarks() const;

 private:
  bool sees_images_;
  std::map<std::string, std::string> off_;  // by what, where it was first named
  std::set<std::string> on_;
};

// What people should know of how the scenario was set, a sentence each: what presets undid of it,
// and what was named and is idle.
std::vector<std::string> RemarksOn(const Scenario& scenario);

}  // namespace turbidock::trial
