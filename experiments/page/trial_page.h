#pragma once
// A trial as the page's modules know it, and its page.

#include <string>

#include "experiments/page/page.h"
#include "experiments/report/json.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_view.h"
#include "sim/vehicle/scene.h"

namespace turbidock::page {

// Of a folder that `turbidock run --out` wrote: result.json, resolved.yaml and trajectory.csv, with
// cameras/ and video.mp4 where they are there. ConfigError for a folder that holds no trial; what
// else is missing or cannot be read is said in the page.
Page TrialPage(const std::string& folder, const trial::Plugins& plugins = {});

// What is known of a trial before it runs: title, scene, rig, marker, limits. A live page adds to
// it as the trial goes on. What cannot be had (the scene's file is elsewhere) is null and said in
// "missing".
report::Json TrialModel(const trial::Scenario& scenario);

// The scene as MuJoCo compiled it: every geom that is drawn, with shape, size, pose in the vehicle
// or in the world, and colour.
report::Json SceneModel(const vehicle::Scene& scene);

// A trial's log for a page: {series, its Bytes() as Base64, in so many digits; sections, those that
// show it, whose curves have six}.
// Where a page grows, curves are from a row on.
report::Json TracesModel(const trial::Series& series, const trial::ViewCriteria& criteria,
                         int digits, size_t first_row = 0);

// x, y, z, qw, qx, qy, qz.
report::Json PoseModel(const Pose& pose);

// All its numbers in so many digits.
report::Json Rounded(report::Json json, int digits = 6);

}  // namespace turbidock::page
