#include "experiments/farm/store_header.h"

#include <fmt/format.h>

#include <sstream>

#include "experiments/farm/trial_scheduler.h"
#include "experiments/system/build_info.h"

namespace turbidock::farm {
namespace {

// The first line in which two texts differ.
std::string FirstDifference(const std::string& a, const std::string& b) {
  std::istringstream left(a), right(b);
  for (;;) {
    std::string x, y;
    const bool more_left = static_cast<bool>(std::getline(left, x));
    const bool more_right = static_cast<bool>(std::getline(right, y));
    if (!more_left && !more_right) return "";
    if (x == y && more_left == more_right) continue;
    const auto shown = [](const std::string& line, bool is_there) {
      std::string text = line.substr(0, line.find("  # "));  // without the key's description
      text.erase(0, text.find_first_not_of(' '));
      return is_there ? "'" + text + "'" : "nothing";
    };
    return shown(x, more_left) + " in one, " + shown(y, more_right) + " in the other";
  }
}

// A resolved plan less the two keys that say only how many trials a cell has.
std::string WithoutPrecision(const std::string& plan) {
  std::istringstream lines(plan);
  std::string rest;
  for (std::string line; std::getline(lines, line);)
    if (!line.starts_with("precision: ") && !line.starts_with("max_trials: ")) rest += line + "\n";
  return rest;
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
    differences.push_back("the plans differ: " + FirstDifference(a.plan, b.plan));
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
  return less.precision && more.precision && *more.precision <= *less.precision &&
         more.most >= less.most;
}

}  // namespace turbidock::farm
