#pragma once
// Which files a scene is read from, and what is in them.

#include <map>
#include <string>

#include "sim/vehicle/model_files.h"

namespace turbidock::vehicle {

// A digest of each file of the scene, by its path: MJCF, what that includes, meshes and pictures.
// ConfigError as of ReadModel.
std::map<std::string, std::string> ContentsOf(const SceneFiles& scene);

}  // namespace turbidock::vehicle
