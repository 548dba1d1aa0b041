#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "experiments/batch/batch_report.h"
#include "experiments/batch/result_store.h"
#include "experiments/command/command_line.h"
#include "experiments/command/progress.h"
#include "experiments/media/figure.h"
#include "experiments/page/batch_page.h"
#include "experiments/page/page.h"
#include "experiments/page/report_page.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"

namespace turbidock::app {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  trial::Plugins plugins;
  std::vector<std::string> inputs;
  batch::BatchReportOptions batch;
  std::string out, figure;
};

page::Page PageOf(const std::string& input, const ReportArguments& arguments) {
  if (!page::IsFileOfTrials(input)) return page::ResultPage(input, arguments.plugins);
  return page::BatchPage(batch::ResultStore::Read(input), input,
                         {.plugins = arguments.plugins, .report = arguments.batch});
}

// ConfigError for an input that is not there and for options that are not for it.
void RequireSense(const ReportArguments& arguments) {
  if (arguments.inputs.size() > 1)
    throw ConfigError("report shows one result; turbidock compare A B --out FILE.html shows two");
  const std::string& input = arguments.inputs[0];
  std::error_code none;
  if (!fs::exists(input, none)) throw ConfigError(input + ": no such file or folder");
  if (page::IsFileOfTrials(input)) return;
  const auto& [by, over] = arguments.batch;
  if (!by.empty() || !over.empty() || !arguments.figure.empty())
    throw ConfigError(input + ": --by, --over and --figure are for a batch's file");
}

void DrawFigure(const std::string& file, const ReportArguments& arguments) {
  const report::Figure figure = media::FigureOf(
      batch::ReportOf(batch::SummaryOf(batch::ResultStore::Read(file), file, arguments.batch)));
  if (figure.panels.empty())
    throw ConfigError(file +
                      ": has nothing to draw: none of its parameters is a number that varies");
  media::WriteFigure(arguments.figure, figure);
}

int Report(const ReportArguments& arguments) {
  RequireSense(arguments);
  const std::string& input = arguments.inputs[0];
  // who asks for a figure alone gets that alone
  const std::string out =
      arguments.out.empty() && arguments.figure.empty() ? "report.html" : arguments.out;
  system::OutputPlan plan;
  plan.Reads(input);
  std::error_code none;  // which a file gives
  for (const auto& entry : fs::directory_iterator(input, none))
    if (entry.path().extension() != ".html") plan.Reads(entry.path().string());
  plan.Writes(out, page::kPageFile).Writes(arguments.figure).Require();
  if (!arguments.figure.empty()) DrawFigure(input, arguments);
  if (out.empty()) return command::kExitDone;
  const page::Page page = PageOf(input, arguments);
  page::WritePage(out, page);
  command::Progress(/*quiet=*/false)
      .Say(system::OneLineOf(fmt::format("{}: {}, {:.1f} MB", out, page.model.value("title", ""),
                                         static_cast<double>(fs::file_size(out)) / 1e6)));
  return command::kExitDone;
}

}  // namespace

void AddReport(command::CommandLine& line) {
  auto [report, arguments] = line.Add("report", "One HTML page that shows a result", &Report);
  arguments.plugins = line.plugins();
  report
      .Add("input", arguments.inputs,
           "What to show: the folder of a trial, a gate or a tuning study; a batch's file; the "
           "JSON\n"
           "that a study printed with --json")
      .Required();
  report.Add("--by KEY,...", arguments.batch.by,
             "Of a batch, a curve for each value of these parameters");
  report.Add("--over KEY", arguments.batch.over, "Of a batch, draw success over this parameter");
  report.AddFigure(arguments.figure, "Draw a batch's success");
  report.Add(
      "--out FILE.html", arguments.out,
      "The page: one file, to be opened in a browser [report.html, unless there is --figure]");
}

}  // namespace turbidock::app
