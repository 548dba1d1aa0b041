#pragma once
// The figure of a trial after the published Fig. 19: how F and the pose went, and the stages.

#include <string>

#include "experiments/trial/trial_record.h"
#include "experiments/trial/trial_view.h"

namespace turbidock::run {

struct FigureInfo {
  std::string title;    // "night sea, active marker, 15 ml/m3, seed 1"
  std::string outcome;  // "Docked after 38.2 s: ..."
  trial::ViewCriteria criteria = {};
};

inline constexpr int kFigureWidth = 1400, kFigureHeight = 1600;

// Draws panels of F, x, y, z (mm) and yaw (deg) over time into a file: estimate, truth and desired
// values, the limits, and the stages as coloured bands. Estimates below the limit of detection are
// dots, not lines: nothing acts on them. The log must have a frame. ConfigError when the path
// cannot be written, SimulatorFault when gnuplot is missing or fails.
void WriteTrialFigure(const std::string& path, const trial::TrialLog& log, const FigureInfo& info);

}  // namespace turbidock::run
