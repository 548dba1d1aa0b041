#include "experiments/command/report_output.h"

#include <cstdio>

#include "experiments/media/figure.h"
#include "experiments/page/report_page.h"
#include "experiments/report/report.h"
#include "experiments/report/report_json.h"
#include "experiments/system/plain_text.h"

namespace turbidock::command {

void PrintReport(const report::Report& report, const report::Json& result, bool json) {
  const std::string text = json ? report::JsonText(report::Document(report, result))
                                : system::Printable(report::Text(report));
  std::fputs(text.c_str(), stdout);
}

Option ReportOutput::AddTo(Subcommand* command, const std::string& folder_doc) {
  command->AddJson(json);
  command->AddFigure(figure, "Draw its plots");
  return command->Add("--out FOLDER", out, folder_doc);
}

void ReportOutput::Plan(const std::string& kind, system::OutputPlan* outputs) const {
  outputs->Writes(figure);
  if (!out) return;
  media::RequireFigures();
  outputs->WritesInto(*out, {"report.json", "report.md", kind + ".png"})
      .Writes(*out + "/report.html", page::kPageFile);
}

void ReportOutput::Write(const report::Report& report, const report::Json& result) const {
  PrintReport(report, result, json);
  if (!figure.empty()) media::WriteFigure(figure, media::FigureOf(report));
  if (!out) return;
  const report::Json document = report::Document(report, result);
  system::MakeFolder(*out);
  media::WriteFigure(*out + "/" + report.kind + ".png", media::FigureOf(report));
  system::WriteWhole(*out + "/report.md", report::Markdown(report));
  system::WriteWhole(*out + "/report.json", report::JsonText(document));
  page::WritePage(*out + "/report.html", page::ReportPage(document, *out));
}

}  // namespace turbidock::command
