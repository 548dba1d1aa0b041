#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/page/page.h"
#include "experiments/page/trial_page.h"
#include "experiments/system/output_path.h"

namespace turbidock::app {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  std::vector<std::string> inputs;
  std::string out = "report.html";
};

page::Page PageOf(const ReportArguments& arguments) { return page::TrialPage(arguments.inputs[0]); }

int Report(const ReportArguments& arguments) {
  system::RequireWritable(arguments.out);
  const page::Page page = PageOf(arguments);
  page::WritePage(arguments.out, page);
  std::fprintf(stderr, "%s: %s, %.1f MB\n", arguments.out.c_str(),
               page.model.value("title", "").c_str(),
               static_cast<double>(fs::file_size(arguments.out)) / 1e6);
  return kExitDone;
}

}  // namespace

void AddReport(CommandLine& line) {
  auto [report, arguments] = line.Add("report", "One HTML page that shows a result", &Report);
  report.Add("inputs", arguments.inputs, "What to show: a trial's folder").Required();
  report.Add("--out FILE.html", arguments.out, "The page: one file, to be opened in a browser");
}

}  // namespace turbidock::app
