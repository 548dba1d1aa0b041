#pragma once
// Where the report of a command goes: to its standard output, into a figure, into a folder.

#include <optional>
#include <string>

#include "experiments/command/command_line.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/system/output_path.h"

namespace turbidock::command {

// On stdout: for people the report, with `json` the document of it and of the study's `result`
// (report/report_json.h).
void PrintReport(const report::Report& report, const report::Json& result, bool json);

struct ReportOutput {
  bool json = false;  // print the document, not the text
  std::string figure = {};
  // Folder for report.json, report.md, report.html and the plots, KIND.png.
  std::optional<std::string> out = {};

  // Adds --json, --figure and --out; returns --out.
  Option AddTo(Subcommand* command, const std::string& folder_doc);

  // Adds its files to what a command writes; `kind` is the report's. SimulatorFault when this
  // machine cannot draw.
  void Plan(const std::string& kind, system::OutputPlan* outputs) const;

  // `result`: the study's own numbers (report/report_json.h). ConfigError for what cannot be
  // written.
  void Write(const report::Report& report, const report::Json& result) const;
};

}  // namespace turbidock::command
