#include "experiments/batch/store_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "experiments/batch/trial_scheduler.h"
#include "experiments/system/build_info.h"

namespace turbidock::batch {
namespace {

// The first line in which two plans differ, without its comment.
std::string FirstDifference(const std::string& a, const std::string& b) {
  std::istringstream left(a), right(b);
  const auto next = [](std::istringstream* lines) -> std::string {
    std::string line;
    if (!std::getline(*lines, line)) return "nothing";
    line.resize(std::min(line.size(), line.find("  # ")));
    return "'" + line.erase(0, line.find_first_not_of(' ')) + "'";
  };
  std::string x, y;
  do {
    x = next(&left);
    y = next(&right);
  } while (x == y && left);
  const size_t content = x.find(": content ");  // of a file
  if (content != std::string::npos && x.substr(0, content) == y.substr(0, content))
    return "the model file " + x.substr(1, content - 1) + " has changed";
  return "the plans differ: " + x + " in one, " + y + " in the other";
}

// A resolved plan less the key that says only how many trials a cell has.
std::string WithoutPrecision(std::string plan) {
  const size_t begin = plan.find("\nprecision: ") + 1;
  return begin == 0 ? plan : plan.erase(begin, plan.find('\n', begin) - begin);
}

}  // namespace

StoreHeader HeaderOf(const Plan& plan, const Shard& shard) {
  return {.kind = "batch",
          .plan = plan.resolved(),
          .build = system::BuildId(),
          .shard = shard,
          .trials = plan.trials(),
          .keys = plan.keys()};
}

std::vector<std::string> Differences(const StoreHeader& a, const StoreHeader& b) {
  std::vector<std::string> differences;
  if (a.kind != b.kind)
    differences.push_back("one was written by " + a.kind + ", the other by " + b.kind);
  if (a.plan != b.plan)
    differences.push_back(FirstDifference(a.plan, b.plan));
  else if (a.trials != b.trials)
    differences.push_back(fmt::format("one has {} trials, the other {}", a.trials, b.trials));
  if (a.build != b.build)
    differences.push_back("the builds differ: " + a.build + " and " + b.build);
  return differences;
}

bool AsksForMore(const StoreHeader& now, const StoreHeader& before) {
  if (now.kind != before.kind || now.build != before.build || now.shard != before.shard ||
      now.plan == before.plan || WithoutPrecision(now.plan) != WithoutPrecision(before.plan))
    return false;
  const TrialRule more = RuleOf(now), less = RuleOf(before);
  return less.precision && more.precision && *more.precision <= *less.precision;
}

}  // namespace turbidock::batch
