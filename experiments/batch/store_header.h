#pragma once
// What the trials of a result file are results of, and whether two files belong together.

#include <cstdint>
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

// How two headers differ, a sentence each; empty when results of both belong together. Shards may
// differ.
std::vector<std::string> Differences(const StoreHeader& a, const StoreHeader& b);

// Whether all trials of the one batch are trials of the other, which goes on where it ends: a cell
// stops no earlier for a higher precision.
bool AsksForMore(const StoreHeader& now, const StoreHeader& before);

}  // namespace turbidock::batch
