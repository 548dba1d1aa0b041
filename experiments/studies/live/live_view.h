#pragma once
// Serves a running trial to browsers, until it is told to stop.

#include <functional>
#include <optional>
#include <string>

#include "experiments/serve/server.h"
#include "experiments/trial/scenario.h"

namespace turbidock::live {

struct ViewOptions {
  serve::Place place;
  int jpeg_quality = 80;
  std::optional<std::string> out;  // existing folder for the files of the last trial that ended
  std::function<void(const std::string& url)> on_served;
  std::function<void(const std::string& line)> say;
  std::function<bool()> stop_requested;
};

// What it was like.
struct ViewSummary {
  int64_t frames = 0;
  double step_s = 0;  // in which they were simulated
  int64_t pictures = 0;
  double encode_s = 0;
  int64_t bytes = 0;
};

// Simulates in the calling thread, in step with real time, and serves in another. The trial waits
// for the first page to open; it goes on when all are closed, with a picture a second. ConfigError
// and SimulatorFault as of a trial and of a server.
ViewSummary ServeTrial(const trial::Scenario& scenario, const ViewOptions& options);

}  // namespace turbidock::live
