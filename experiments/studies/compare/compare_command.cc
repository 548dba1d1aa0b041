#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/farm/result_store.h"
#include "experiments/studies/compare/comparison.h"
#include "experiments/system/output_path.h"

namespace turbidock::compare {
namespace {

struct CompareArguments {
  std::string a, b, figure;
  ComparisonOptions options;
  std::vector<std::string> metrics = {"time_s", "final_error_m"};
  bool json = false;
};

void PrintGroup(const ComparisonGroup& group, const std::vector<trial::Metric>& metrics) {
  const RateComparison r = CompareRates(group.pairs);
  fmt::print("{}: {} pairs\n", GroupName(group), r.pairs);
  fmt::print("  {:24} {:5.1f} % -> {:5.1f} %, {:+.1f} points [{:+.1f}, {:+.1f}], p = {:.3g}\n",
             "success rate", 100 * r.rate_a, 100 * r.rate_b, 100 * r.difference,
             100 * r.interval_95.low, 100 * r.interval_95.high, r.p_value);
  for (const trial::Metric& metric : metrics) {
    const MetricComparison m = CompareMetric(group.pairs, metric);
    if (!m.median_difference) {
      fmt::print("  {:24} no pair that docked in both\n", m.metric);
      continue;
    }
    fmt::print("  {:24} {:.4g} -> {:.4g}, {:+.3g}{}, {} of {} larger, p = {:.3g}\n", m.metric,
               *m.median_a, *m.median_b, *m.median_difference,
               m.interval_95
                   ? fmt::format(" [{:+.3g}, {:+.3g}]", m.interval_95->low, m.interval_95->high)
                   : "",
               m.larger, m.pairs, m.p_value);
  }
  for (const bool lost : {true, false})
    for (const TrialPair& pair : Flipped(group.pairs, lost))
      fmt::print("  {} seed {}, trials {} and {}: {}\n", lost ? "lost  " : "gained", pair.a.seed,
                 pair.trial_a, pair.trial_b, NameOf(lost ? pair.b.failure : pair.a.failure));
}

int Compare(const CompareArguments& arguments) {
  std::vector<trial::Metric> metrics;
  for (const std::string& name : arguments.metrics) metrics.push_back(MetricNamed(name));
  system::OutputPlan().Reads(arguments.a).Reads(arguments.b).Writes(arguments.figure).Require();
  const farm::ResultStore a = farm::ResultStore::Read(arguments.a),
                          b = farm::ResultStore::Read(arguments.b);
  const std::vector<TrialPair> pairs = PairTrials(a, b, arguments.options);
  const std::vector<ComparisonGroup> groups = GroupPairs(pairs, arguments.options.by);
  if (arguments.json)
    std::fputs(ComparisonJson(arguments.a, arguments.b, a, b, groups, metrics).c_str(), stdout);
  else
    for (const ComparisonGroup& group : groups) PrintGroup(group, metrics);
  if (!arguments.figure.empty())
    WriteComparisonFigure(arguments.figure, groups, arguments.a, arguments.b);
  return app::kExitDone;
}

}  // namespace

void AddCompare(app::CommandLine& line) {
  auto [compare, arguments] =
      line.Add("compare", "Two result sets pair by pair: same seed, same parameters", &Compare);
  compare.Add("a", arguments.a, "A batch's file").Required();
  compare.Add("b", arguments.b, "Another one's").Required();
  compare.Add("--by KEY,...", arguments.options.by, "One group for each value of these parameters");
  compare.Add("--ignore KEY,...", arguments.options.ignore,
              "Parameters in which the sets are meant to differ");
  compare.Add("--metrics NAME,...", arguments.metrics, "What to compare where both docked");
  compare.Add("--figure FILE", arguments.figure, "Also draw it: .png, .svg or .pdf");
  compare.Flag("--json", arguments.json, "As JSON");
}

}  // namespace turbidock::compare
