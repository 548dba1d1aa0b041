#pragma once
// Serves a running trial, or the page of a result which may still grow, until it is told to stop.

#include <functional>
#include <string>

#include "experiments/page/page.h"
#include "experiments/serve/server.h"
#include "experiments/studies/live/live_session.h"
#include "experiments/trial/scenario.h"

namespace turbidock::live {

struct ServeOptions {
  serve::Endpoint endpoint;
  std::function<void(const std::string& url)> on_served;
  std::function<bool()> stop_requested;
};

// Simulates in the calling thread, in step with real time, and serves in another. The trial waits
// for the first page to open and goes on when all are closed. ConfigError and SimulatorFault as of
// a trial and of a server.
void ServeTrial(const trial::Scenario& scenario, const ServeOptions& options,
                const LiveSession::OnResult& on_result);

// Serves the page of a result. It is made anew when it is asked for, but rests ten times as long as
// that took, two seconds at least. What `make_page` throws before anything was served ends it;
// later it is said in place of the page.
void ServeResult(const std::function<page::Page()>& make_page, const ServeOptions& options);

}  // namespace turbidock::live
