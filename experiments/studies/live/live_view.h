#pragma once
// Serves a running trial to browsers, until it is told to stop.

#include <functional>
#include <optional>
#include <string>

#include "experiments/studies/live/live_board.h"
#include "experiments/studies/live/result_view.h"
#include "experiments/trial/scenario.h"

namespace turbidock::live {

struct ViewOptions : ServeOptions {
  int jpeg_quality = 80;
  std::optional<std::string> out = {};  // folder for the files of the last trial that ended
  std::function<void(const std::string& line)> say;
};

// What it was like.
struct ViewSummary {
  int64_t frames = 0;
  double step_s = 0;  // in which they were simulated
  ShowCost shown;
};

// Simulates in the calling thread, in step with real time, and serves in another. The trial waits
// for the first page to open; it goes on when all are closed, with a picture a second. ConfigError
// and SimulatorFault as of a trial and of a server.
ViewSummary ServeTrial(const trial::Scenario& scenario, const ViewOptions& options);

}  // namespace turbidock::live
