#pragma once
// What a file of trials says: how far it is, and what came out.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/batch.h"
#include "experiments/batch/result_store.h"
#include "experiments/batch/summary.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"

namespace turbidock::batch {

struct BatchReportOptions {
  // Parameters, or what else trials can be grouped by (summary.h): the table has a row for each of
  // their values, also of `over`; of the parameters, success has a curve for each value. Empty: of
  // a batch by its grid, as far as people look through its cells; never by what was drawn.
  std::vector<std::string> by = {};
  // Success is drawn over this parameter. Empty: of a batch, over the first of its grid that is a
  // number, by the next of few values, if the curves can be told apart.
  std::string over = {};
};

struct BatchSummary {
  std::string file, title;  // the title: the plan's description
  StoreHeader header;
  bool running = false;  // somebody writes to the file
  TrialRule rule;
  TrialScheduler scheduler;  // what is to run yet
  int64_t trials = 0;        // in the file
  GroupSummary all = {};     // of all of them
  std::vector<std::string> keys;
  std::vector<GroupSummary> groups;  // by these keys
  std::string over;
  std::vector<std::string> curves_by = {};
  std::vector<std::string> pooled =
      {};  // varied keys of the grid that the curves do not tell apart
  std::vector<SuccessCurve> curves = {};         // may be none
  std::optional<report::Section> envelope = {};  // of a plan with ranges
  report::Json envelope_json = {};
  std::optional<report::Section> failures = {};  // what goes with them, of enough of them
};

// `file` is the store's. ConfigError for a key that its trials do not have, or to draw over one
// that is no number.
BatchSummary SummaryOf(const ResultStore& store, const std::string& file,
                       const BatchReportOptions& options = {});

report::Report ReportOf(const BatchSummary& summary);
// The numbers, which stand beside the report in its document.
report::Json ResultJson(const BatchSummary& summary);

// Of what a trial is made of, the groups of keys that the plan leaves alone, as words; starts and
// whatever else a seed decides differ anyway. Empty where the plan cannot be read.
std::vector<std::string> NotVaried(const StoreHeader& header);

// The keys that tell a batch's cells apart; none of anything else.
std::vector<std::string> GridOf(const StoreHeader& header);

// "17 of 480" or, where the total is not known yet, "17 of 320 (at most 480)".
std::string DoneText(int64_t done, int64_t total, int64_t most);

}  // namespace turbidock::batch
