#pragma once
// A trial as the page's modules know it (README.md: the model of a trial).

#include <string>

#include "experiments/report/json.h"
#include "experiments/trial/scenario.h"
#include "sim/vehicle/scene.h"

namespace turbidock::page {

// What is known of a trial before it runs: title, scene, rig, marker, limits, settings that differ
// from what every scenario begins with. A live page adds to it as the trial goes on. What cannot be
// had (the scene's file is elsewhere) is null and said in "missing".
report::Json TrialModel(const trial::Scenario& scenario);

// The scene as MuJoCo compiled it: every geom that is drawn, with shape, size, pose in the vehicle
// or in the world, and colour.
report::Json SceneModel(const vehicle::Scene& scene);

// The keys whose values differ from what every scenario with these presets begins with.
report::Json SettingsModel(const trial::Scenario& scenario);

// x, y, z, qw, qx, qy, qz.
report::Json PoseModel(const Pose& pose);

// All its numbers, such as a trial::Series's, in so many digits.
report::Json Rounded(report::Json json, int digits = 6);

}  // namespace turbidock::page
