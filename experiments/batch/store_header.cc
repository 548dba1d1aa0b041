#include "experiments/batch/store_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "experiments/config/yaml_fields.h"
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

}  // namespace

StoreHeader HeaderOf(const Plan& plan, const Shard& shard) {
  return {.kind = "batch",
          .plan = plan.resolved(),
          .build = system::BuildId(),
          .shard = shard,
          .trials = plan.trials(),
          .keys = plan.keys()};
}

TrialRule RuleOf(const StoreHeader& header) {
  TrialRule rule{.batch = header.trials, .most = header.trials, .precision = {}};
  if (header.kind != "batch") return rule;
  const config::Layers plan{.files = {config::ParseYaml(header.plan, "plan")}};
  if (const auto strata = plan.files.front().Find("strata"))
    rule.strata = std::max<int64_t>(1, std::ssize(strata->Entries()));
  const int64_t seeds = config::Peek(plan, "seeds", 1);
  const double precision = config::Peek(plan, "precision", 0.0);
  const int64_t samples = seeds < 1 ? 0 : SamplesOf(seeds, precision);
  if (samples < 1 || seeds % rule.strata != 0 || header.trials < samples ||
      header.trials % samples != 0)
    throw ConfigError(
        "its plan's seeds, precision and strata do not go together with its number of trials");
  if (precision > 0)
    rule = {.cells = header.trials / samples,
            .batch = seeds,
            .most = samples,
            .precision = precision,
            .strata = rule.strata};
  return rule;
}

bool IsOf(const Shard& shard, const TrialRule& rule, int64_t trial) {
  return shard.Has(rule.precision ? trial % rule.cells : trial / rule.strata);
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

}  // namespace turbidock::batch
