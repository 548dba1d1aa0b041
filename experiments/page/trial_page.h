#pragma once
// The report of one trial.

#include <string>

#include "experiments/page/page.h"
#include "experiments/trial/plugins.h"

namespace turbidock::page {

// Of a folder that `turbidock run --out` wrote: result.json, resolved.yaml and trajectory.csv, with
// cameras/ and video.mp4 where they are there. ConfigError for a folder that holds no trial; what
// else is missing or cannot be read is said in the page.
Page TrialPage(const std::string& folder, const trial::Plugins& plugins = {});

}  // namespace turbidock::page
