#pragma once
// From files to MuJoCo's model: a scene, the files that are taken for those it includes, the meshes
// and pictures that these name.
//
// Users' files come this way, so what MuJoCo would crash on, read without end or take for the whole
// scene is refused here, with file and line.

#include <mujoco/mujoco.h>

#include <map>
#include <memory>
#include <string>

namespace turbidock::vehicle {

struct MjModelDeleter {
  void operator()(mjModel* m) const { mj_deleteModel(m); }
};
using MjModelPtr = std::unique_ptr<mjModel, MjModelDeleter>;

// Where the files of a scene are.
struct SceneFiles {
  std::string scene;  // MJCF
  // Files to be taken for those that the scene includes by these names, wherever it would look for
  // them; what they include, meshes and pictures stand beside them.
  std::map<std::string, std::string> parts{};
  // The same of files that belong to the scene: what it includes and its folder lacks.
  std::map<std::string, std::string> shared{};
};

// The model. ConfigError with the file's name and MuJoCo's message (which has the line), or with
// what is not allowed in it:
// - any file: what model_limits.h refuses, a place or size that is no number or beyond 10 km, a
//   mesh or picture that is no file (a pipe would be waited for);
// - a part: <option>, <compiler>, <equality> and others that would hold for the whole scene; a file
//   of its own that has the name of one that the scene includes.
MjModelPtr ReadModel(const SceneFiles& files);

// The scene's file, and the parts in it that it does not name.
std::string Where(const SceneFiles& files);

}  // namespace turbidock::vehicle
