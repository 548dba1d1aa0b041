#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/progress.h"
#include "experiments/farm/result_store.h"
#include "experiments/page/batch_page.h"
#include "experiments/page/page.h"
#include "experiments/page/result_page.h"
#include "experiments/page/study_page.h"
#include "experiments/report/json.h"
#include "experiments/studies/compare/comparison.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"

namespace turbidock::app {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  trial::Plugins plugins;
  std::vector<std::string> inputs;
  std::string out = "report.html";
  std::optional<int64_t> trial;
  compare::ComparisonOptions comparison;
};

page::Page PageOfOne(const std::string& given, const std::optional<int64_t>& trial,
                     const trial::Plugins& plugins) {
  const std::string file = page::TrialsOfUnfinishedStudy(given).value_or(given);
  if (!page::IsFileOfTrials(file)) return page::ResultPage(given, plugins);
  const farm::ResultStore store = farm::ResultStore::Read(file);
  return trial ? page::StoredTrialPage(store, file, *trial, plugins)
               : page::BatchPage(store, file, {.plugins = plugins});
}

page::Page PageOfTwo(const std::string& a, const std::string& b,
                     const compare::ComparisonOptions& options) {
  const farm::ResultStore before = farm::ResultStore::Read(a), after = farm::ResultStore::Read(b);
  const auto pairs = compare::PairTrials(before, after, options);
  std::vector<trial::Metric> metrics = {compare::MetricNamed("final_error_m")};
  for (const trial::Metric& metric : trial::Metrics()) metrics.push_back(metric);
  const std::string text =
      compare::ComparisonJson(a, b, before, after, compare::GroupPairs(pairs, options.by), metrics);
  return page::ComparisonPage(report::ParseJson(text, "comparison"), {before, a}, {after, b});
}

page::Page PageOf(const ReportArguments& arguments) {
  const std::vector<std::string>& inputs = arguments.inputs;
  if (inputs.size() > 2)
    throw ConfigError("report shows one result, or two batches side by side, not " +
                      std::to_string(inputs.size()));
  const bool are_two = inputs.size() == 2;
  std::error_code none;
  for (const std::string& input : inputs) {
    if (!fs::exists(input, none)) throw ConfigError(input + ": no such file or folder");
    if (are_two && !page::IsFileOfTrials(input))
      throw ConfigError(input + ": is no batch's file; two of them are compared");
  }
  if (arguments.trial && (are_two || !page::IsFileOfTrials(inputs[0])))
    throw ConfigError("--trial is for one batch's file");
  const compare::ComparisonOptions& comparison = arguments.comparison;
  if (!are_two && !(comparison.by.empty() && comparison.ignore.empty()))
    throw ConfigError("--by and --ignore are for two batches");
  return are_two ? PageOfTwo(inputs[0], inputs[1], comparison)
                 : PageOfOne(inputs[0], arguments.trial, arguments.plugins);
}

int Report(const ReportArguments& arguments) {
  system::OutputPlan plan;
  for (const std::string& input : arguments.inputs) {
    plan.Reads(input);
    std::error_code none;  // which a file gives
    for (const auto& entry : fs::directory_iterator(input, none))
      if (entry.path().extension() != ".html") plan.Reads(entry.path().string());
  }
  plan.Writes(arguments.out).Require();
  const page::Page page = PageOf(arguments);
  page::WritePage(arguments.out, page);
  Progress(/*quiet=*/false)
      .Say(system::OneLineOf(fmt::format("{}: {}, {:.1f} MB", arguments.out,
                                         page.model.value("title", ""),
                                         static_cast<double>(fs::file_size(arguments.out)) / 1e6)));
  return kExitDone;
}

}  // namespace

void AddReport(CommandLine& line) {
  auto [report, arguments] = line.Add("report", "One HTML page that shows a result", &Report);
  arguments.plugins = line.plugins();
  report
      .Add("inputs", arguments.inputs,
           "What to show: the folder of a trial, a gate or a tuning study; a batch's file; two of\n"
           "them, to compare; the JSON of recognize, compare or compare-estimators")
      .Required();
  report.Add("--trial", arguments.trial, "Of a batch, this trial alone");
  report.Add("--by KEY,...", arguments.comparison.by,
             "Of two batches, one group for each value of these parameters");
  report.Add("--ignore KEY,...", arguments.comparison.ignore,
             "Of two batches, parameters in which they are meant to differ");
  report.Add("--out FILE.html", arguments.out, "The page: one file, to be opened in a browser");
}

}  // namespace turbidock::app
