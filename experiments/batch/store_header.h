#pragma once
// What the trials of a result file are results of, and whether two files belong together.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "sim/base/digest.h"

namespace turbidock::batch {

// What a file holds the results of.
struct StoreHeader {
  std::string kind = "batch";  // or "tune", "gate": who wrote it
  std::string plan;            // the resolved plan (or study): every value spelt out
  std::string build;           // BuildId of the program
  Shard shard;
  int64_t trials = 0;             // of the plan, all shards together
  std::vector<std::string> keys;  // of the parameters that trials differ in

  std::string plan_hash() const { return DigestOf(plan); }
};

StoreHeader HeaderOf(const Plan& plan, const Shard& shard);

struct TrialRule {
  int64_t cells = 1;
  int64_t batch = 1;                // trials of a cell after which it is looked at
  int64_t most = 1;                 // trials of a cell
  std::optional<double> precision;  // half width of a cell's interval; none: every trial is to run
  int64_t strata = 1;               // a cell's samples are of each in turn
};

// Whether the shard runs this trial: without a precision a shard takes whole rounds of strata, with
// one whole cells, which it decides about alone.
bool IsOf(const Shard& shard, const TrialRule& rule, int64_t trial);

// The rule that a file's trials follow. Without a precision it knows of no cells.
TrialRule RuleOf(const StoreHeader& header);

// How two headers differ, a sentence each; empty when results of both belong together. Shards may
// differ.
std::vector<std::string> Differences(const StoreHeader& a, const StoreHeader& b);

}  // namespace turbidock::batch
