#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/progress.h"
#include "experiments/batch/batch_report.h"
#include "experiments/batch/result_store.h"
#include "experiments/media/figure.h"
#include "experiments/page/batch_page.h"
#include "experiments/page/page.h"
#include "experiments/page/report_page.h"
#include "experiments/studies/compare/comparison.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"

namespace turbidock::app {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  trial::Plugins plugins;
  std::vector<std::string> inputs, by, ignore;
  std::string out, figure, over;

  bool are_two() const { return inputs.size() == 2; }
  batch::BatchReportOptions batch() const { return {.by = by, .over = over}; }
};

page::Page PageOfTwo(const ReportArguments& arguments) {
  const std::string &a = arguments.inputs[0], &b = arguments.inputs[1];
  const batch::ResultStore in_a = batch::ResultStore::Read(a), in_b = batch::ResultStore::Read(b);
  return compare::PageOf(
      compare::Compare({in_a, a}, {in_b, b}, {.by = arguments.by, .ignore = arguments.ignore}),
      {in_a, a}, {in_b, b}, arguments.plugins);
}

page::Page PageOf(const ReportArguments& arguments) {
  if (arguments.are_two()) return PageOfTwo(arguments);
  const std::string& file = arguments.inputs[0];
  if (!page::IsFileOfTrials(file)) return page::ResultPage(file, arguments.plugins);
  return page::BatchPage(batch::ResultStore::Read(file), file,
                         {.plugins = arguments.plugins, .report = arguments.batch()});
}

// ConfigError for inputs that are not there and for options that are not for these.
void RequireSense(const ReportArguments& arguments) {
  const std::vector<std::string>& inputs = arguments.inputs;
  if (inputs.size() > 2)
    throw ConfigError("report shows one result, or two batches side by side, not " +
                      std::to_string(inputs.size()));
  std::error_code none;
  for (const std::string& input : inputs) {
    if (!fs::exists(input, none)) throw ConfigError(input + ": no such file or folder");
    if (arguments.are_two() && !page::IsFileOfTrials(input))
      throw ConfigError(input + ": is no batch's file; two of them are compared");
  }
  const bool is_batch = page::IsFileOfTrials(inputs[0]);
  const bool is_one = is_batch && !arguments.are_two();
  if (!arguments.over.empty() && !is_one) throw ConfigError("--over is for one batch's file");
  if (!arguments.ignore.empty() && !arguments.are_two())
    throw ConfigError("--ignore is for two batches");
  if (!arguments.by.empty() && !is_batch) throw ConfigError("--by is for a batch's file or two");
  if (!arguments.figure.empty() && !is_one)
    throw ConfigError("--figure is for one batch's file; turbidock compare draws how two differ");
}

void DrawFigure(const ReportArguments& arguments) {
  const std::string& file = arguments.inputs[0];
  const report::Figure figure = media::FigureOf(
      batch::ReportOf(batch::SummaryOf(batch::ResultStore::Read(file), file, arguments.batch())));
  if (figure.panels.empty())
    throw ConfigError(file +
                      ": has nothing to draw: none of its parameters is a number that varies");
  media::WriteFigure(arguments.figure, figure);
}

int Report(const ReportArguments& arguments) {
  RequireSense(arguments);
  // who asks for a figure alone gets that alone
  const std::string out =
      arguments.out.empty() && arguments.figure.empty() ? "report.html" : arguments.out;
  system::OutputPlan plan;
  for (const std::string& input : arguments.inputs) {
    plan.Reads(input);
    std::error_code none;  // which a file gives
    for (const auto& entry : fs::directory_iterator(input, none))
      if (entry.path().extension() != ".html") plan.Reads(entry.path().string());
  }
  plan.Writes(out).Writes(arguments.figure).Require();
  if (!arguments.figure.empty()) DrawFigure(arguments);
  if (out.empty()) return kExitDone;
  const page::Page page = PageOf(arguments);
  page::WritePage(out, page);
  Progress(/*quiet=*/false)
      .Say(system::OneLineOf(fmt::format("{}: {}, {:.1f} MB", out, page.model.value("title", ""),
                                         static_cast<double>(fs::file_size(out)) / 1e6)));
  return kExitDone;
}

}  // namespace

void AddReport(CommandLine& line) {
  auto [report, arguments] = line.Add("report", "One HTML page that shows a result", &Report);
  arguments.plugins = line.plugins();
  report
      .Add("inputs", arguments.inputs,
           "What to show: the folder of a trial, a gate or a tuning study; a batch's file; two of\n"
           "them, to compare; the JSON that a study printed with --json")
      .Required();
  report.Add("--by KEY,...", arguments.by,
             "A curve, or a group of two batches, for each value of these parameters");
  report.Add("--over KEY", arguments.over, "Of a batch, draw success over this parameter");
  report.Add("--ignore KEY,...", arguments.ignore,
             "Of two batches, parameters in which they are meant to differ");
  report.AddFigure(arguments.figure, "Draw a batch's success");
  report.Add(
      "--out FILE.html", arguments.out,
      "The page: one file, to be opened in a browser [report.html, unless there is --figure]");
}

}  // namespace turbidock::app
