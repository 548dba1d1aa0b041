#pragma once
// How an MJCF file gives angles. To MuJoCo one <compiler> holds for all that a scene includes; here
// a part's own holds for the part, whose angles are turned into the scene's.

#include <string>

#include "sim/vehicle/mjcf_tags.h"

namespace turbidock::vehicle {

struct Angles {
  bool in_degrees = false;
  std::string eulerseq = "xyz";

  // Takes over what a <compiler> says. ConfigError for what MuJoCo would not read.
  void Read(const Tag& compiler, const std::string& where);
  bool operator==(const Angles&) const = default;
};

// The text of a part whose angles are so, in the scene's: radians about x, y and z in turn. Lines
// stay where they are.
std::string WithSceneAngles(const std::string& xml, const Angles& part);

// ConfigError for an angle of more than a turn, which is one in degrees that is read as radians.
void RequireTurns(const Tag& tag, const Angles& part, const std::string& where);

}  // namespace turbidock::vehicle
