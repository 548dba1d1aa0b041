#pragma once
// What the trials of a plan with ranges say: where success crosses the rate that was looked for, in
// words, numbers and pictures.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/batch/plan_ranges.h"
#include "experiments/batch/result_store.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/search/boundary_difference.h"
#include "experiments/search/boundary_search.h"

namespace turbidock::batch {

// Where success crosses the rate along one range, the others being at stated values: median and
// 95 % interval of the posterior. Infinite: before `from` (below 0) or beyond `to`.
struct Crossing {
  size_t range = 0;          // of the plan's
  std::vector<double> at{};  // values of all ranges; of this one none
  bool falls = true;         // success, along it
  // The part of the range that it is looked for in: all, unless there are several.
  double from = 0, to = 0;
  double value = 0, low = 0, high = 0;  // low is below high, also where a range runs down
  double before = 0, beyond = 0;        // probability that it is outside of that part
  std::vector<double> drawn{};          // draw by draw; where outside, that end of the part
};

// Of one combination of cases and grid.
struct Envelope {
  std::string name{};  // its values; empty of the only one
  int64_t trials = 0;
  bool reached = false;  // the width that was asked for
  search::Boundary boundary{};
  std::vector<Crossing> crossings{};
  search::Estimate area{};            // share of the ranges in which success is above the rate
  std::vector<std::string> limits{};  // sentences: what the answer does not hold for
  std::vector<const StoredTrial*> shown{};  // its trials
};

// How far another envelope reaches beyond the first, trials of the same seeds pair by pair.
struct EnvelopeDifference {
  size_t envelope = 0;  // of the summary's
  int64_t pairs = 0;
  search::Difference area{};
  // Of which crossing of both, where both are in the ranges.
  std::vector<std::pair<size_t, search::Difference>> crossings{};
};

struct EnvelopeSummary {
  EnvelopePlan plan = {};
  std::vector<Envelope> envelopes = {};
  std::vector<EnvelopeDifference> differences = {};  // of all but the first
};

// Of trials of one combination; those whose end says nothing of success do not count. They must
// outlive what points to them.
Envelope EnvelopeOf(const EnvelopePlan& plan, std::string name,
                    std::vector<const StoredTrial*> trials);

// Of a batch with ranges; nothing of any other. The trials must outlive what points to them.
std::optional<EnvelopeSummary> EnvelopesOf(const StoreHeader& header,
                                           const std::vector<StoredTrial>& trials);

// "90 % up to 42 [39, 45] ml/m³".
std::string CrossingText(const EnvelopeSummary& summary, const Crossing& crossing);

// "passive less active: area above 90 % -12 [-17, -7] % of the ranges, ...": a line each.
std::vector<std::string> DifferenceTexts(const EnvelopeSummary& summary,
                                         const EnvelopeDifference& difference);

report::Section EnvelopeSection(const EnvelopeSummary& summary);
report::Json EnvelopeJson(const EnvelopeSummary& summary);

// What a point of the section's pictures opens: a trial.
std::string TrialLink(int64_t trial);

}  // namespace turbidock::batch
