#pragma once
// What a file of results says of itself, and how two of them differ.

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "sim/base/digest.h"

namespace turbidock::batch {

// What a file holds the results of.
struct StoreHeader {
  std::string kind = "batch";  // or "tune", "gate", "calibrate": who wrote it
  std::string plan;            // the resolved plan (or study): every value spelt out
  std::string build;           // BuildId of the program
  std::string code = {};       // of controllers and estimators that are not this program's own
  Shard shard;
  int64_t trials = 0;             // of the plan, all shards together
  std::vector<std::string> keys;  // of the parameters that trials differ in

  std::string plan_hash() const { return DigestOf(plan); }
  // Whether it has trials of a plan, by that plan's numbers.
  bool is_of_plan() const { return kind == "batch" || kind == "gate"; }
};

StoreHeader HeaderOf(const Plan& plan, const Shard& shard, const std::string& kind = "batch");

// What two resolved plans have of each key in which they differ, in dots; "-" where it is not
// there. A scenario in a plan counts as its keys.
using PlanDifferences = std::map<std::string, std::array<std::string, 2>>;
PlanDifferences DifferencesOf(const std::string& a, const std::string& b);

// What two headers, plans or sets of trials are called.
struct Sides {
  std::string a = "A", b = "B";
};
inline const Sides kThenAndNow = {"then", "now"};

// How two headers differ, in a sentence; empty when results of both belong together. Shards may
// differ.
std::string DifferenceOf(const StoreHeader& a, const StoreHeader& b,
                         const Sides& sides = kThenAndNow);

// What changed since a file was begun, in words: a file, the code of a plug-in, a key, the program.
// Of a plan that only has more cells, cases or trials than before: empty.
std::string ChangeOf(const StoreHeader& before, const StoreHeader& now,
                     const Sides& sides = kThenAndNow);

// The plan where its files are found when the file of results has moved, together with them, from
// one folder to another.
std::string PlanMoved(const std::string& plan, const std::string& from, const std::string& to);

// A setting of its plan as it is written (YAML); empty where it has none.
std::string SettingOf(const StoreHeader& header, const std::string& key);

// A sentence about a file that only one of two plans reads; empty where they read the same ones.
std::string OtherFile(const StoreHeader& before, const StoreHeader& now);

}  // namespace turbidock::batch
