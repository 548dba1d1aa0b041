#pragma once
// The report of one trial.

#include <cstdint>
#include <string>
#include <vector>

#include "experiments/page/page.h"
#include "experiments/trial/plugins.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/series.h"
#include "sim/base/stereo.h"

namespace turbidock::page {

// What both cameras saw in a frame.
struct CameraPictures {
  int64_t frame = 0;
  Stereo<std::string> jpeg;
};

// What there is of a trial that ran.
struct TrialParts {
  report::Json record;  // as in result.json
  trial::Series series;
  std::vector<CameraPictures> pictures = {};
  std::string video = {};  // MP4; empty: none
  report::Json commands;   // what may come next: a list of {what, command}
};
// What else is missing or cannot be read is said in the page.
Page TrialPage(const trial::Scenario& scenario, const TrialParts& parts);

// The one command of a trial whose resolved.yaml is in this folder.
report::Json CommandsOf(const std::string& folder);

// Of a folder that `turbidock run --out` wrote: result.json, resolved.yaml and trajectory.csv, with
// cameras/ and video.mp4 where they are there. ConfigError for a folder that holds no trial.
Page TrialPage(const std::string& folder, const trial::Plugins& plugins = {});

}  // namespace turbidock::page
