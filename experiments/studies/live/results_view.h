#pragma once
// Serves the page of a result: of a file of trials also while they run.

#include <functional>
#include <string>

#include "experiments/page/page.h"
#include "experiments/report/json.h"
#include "experiments/serve/server.h"

namespace turbidock::live {

// How far a file of trials is.
//   running: whether a process is writing; done, successes with their interval; wanted, the least
//   there will be, and expected, guessed where the plan asks for a precision; by_hour of the trials
//   that came since this was first asked for.
class ResultsProgress {
 public:
  // `now_s` of any steady clock. ConfigError for a file that cannot be read.
  report::Json Look(const std::string& file, double now_s);

 private:
  int64_t first_done_ = -1;
  double first_s_ = 0;
};

struct ResultsOptions {
  serve::Place place;
  std::function<void(const std::string& url)> on_served;
  std::function<bool()> stop_requested;
};

// Serves a page that does not change: a recorded trial, a comparison.
void ServePage(const page::Page& page, const ResultsOptions& options);

// Serves the page of a file of trials, made anew whenever it is asked for, and says on it every
// second how far they are. ConfigError where the file cannot be read at the beginning.
void ServeResults(const std::string& file, const std::function<page::Page()>& make_page,
                  const ResultsOptions& options);

}  // namespace turbidock::live
