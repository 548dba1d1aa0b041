#pragma once
// One trial as the terminal shows it, with its files.

#include <optional>
#include <string>
#include <vector>

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::run {

struct ShownTrialOptions {
  std::vector<std::string> inputs = {};  // files that the trial is read from, not to be overwritten
  // Folder for result.json, resolved.yaml, trajectory.csv, figure.png and cameras/.
  std::optional<std::string> out = {};
  bool video = false;       // also video.mp4; needs `out`
  bool report = false;      // also report.html; needs `out`
  bool motion = false;      // also motion.csv; needs `out`
  std::string figure = {};  // the figure in this file, too, unless empty: .png, .svg, .pdf
  bool json = false;        // the result on stdout
  bool quiet = false;       // nothing on stderr
};

// Runs the trial until it ends or a signal stops it.
trial::TrialResult RunShownTrial(const trial::Scenario& scenario, const ShownTrialOptions& options);

}  // namespace turbidock::run
