#include <string>

#include "experiments/command/command_line.h"
#include "experiments/command/report_output.h"
#include "experiments/media/figure.h"
#include "experiments/studies/compare/comparison_page.h"
#include "experiments/system/output_path.h"

namespace turbidock::compare {
namespace {

struct CompareArguments {
  std::string a, b, figure, out;
  ComparisonOptions options;
  bool json = false;
};

int Run(const CompareArguments& arguments) {
  system::OutputPlan()
      .Reads(arguments.a)
      .Reads(arguments.b)
      .Writes(arguments.figure)
      .Writes(arguments.out, page::kPageFile)
      .Require();
  const batch::ResultStore a = batch::ResultStore::Read(arguments.a),
                           b = batch::ResultStore::Read(arguments.b);
  const Comparison comparison = Compare({a, arguments.a}, {b, arguments.b}, arguments.options);
  const report::Report report = ReportOf(comparison);
  command::PrintReport(report, comparison, arguments.json);
  if (!arguments.figure.empty()) media::WriteFigure(arguments.figure, media::FigureOf(report));
  if (!arguments.out.empty())
    page::WritePage(arguments.out, PageOf(comparison, {a, arguments.a}, {b, arguments.b}));
  return command::kExitDone;
}

}  // namespace

void AddCompare(command::CommandLine& line) {
  auto [compare, arguments] =
      line.Add("compare", "Two result sets pair by pair: same seed, same parameters", &Run);
  arguments.options.plugins = line.plugins();
  compare.Add("a", arguments.a, "A batch's file").Required();
  compare.Add("b", arguments.b, "Another one's").Required();
  compare.Add("--by KEY,...", arguments.options.by,
              "More rows: one group for each value of these parameters");
  compare.Add("--ignore KEY,...", arguments.options.ignore,
              "Parameters in which the sets are meant to differ");
  compare.AddFigure(arguments.figure, "Also draw it");
  compare.Add("--out FILE.html", arguments.out,
              "Also a page, on which a seed that ended otherwise opens its two trials");
  compare.Flag("--json", arguments.json, "As JSON");
}

}  // namespace turbidock::compare
