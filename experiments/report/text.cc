#include "experiments/report/text.h"

#include <fmt/format.h>

namespace turbidock::report {
namespace {

// "pass: docking at night".
std::string Heading(const Report& report) {
  return report.verdict.word.empty() ? report.title : report.verdict.word + ": " + report.title;
}

Table FactTable(const Report& report) {
  Table table({"<", "<", "<"});
  for (const Fact& fact : report.facts) table.Row({fact.label, fact.value, fact.note});
  return table;
}

// Without the line of its empty titles.
std::string Facts(const Report& report) {
  const std::string text = FactTable(report).Text();
  return text.substr(text.find('\n') + 1);
}

bool HasText(const Section& section) {
  return section.table || !section.lines.empty() || !section.commands.empty();
}

}  // namespace

std::string Text(const Report& report) {
  std::string text = Heading(report) + "\n";
  if (!report.verdict.reason.empty()) text += report.verdict.reason + "\n";
  if (!report.facts.empty()) text += "\n" + Facts(report);
  for (const std::string& sentence : report.missing) text += sentence + "\n";
  for (const Section& section : report.sections) {
    if (!HasText(section)) continue;
    text += "\n" + section.title + "\n";
    if (!section.note.empty()) text += section.note + "\n";
    if (section.table) text += section.table->Text();
    for (const std::string& line : section.lines) text += line + "\n";
    for (const Command& command : section.commands)
      text += fmt::format("{}:\n  {}\n", command.what, command.command);
  }
  return text;
}

std::string Markdown(const Report& report) {
  std::string text = "# " + Heading(report) + "\n";
  if (!report.verdict.reason.empty()) text += "\n" + report.verdict.reason + "\n";
  if (!report.facts.empty()) text += "\n";
  for (const Fact& fact : report.facts)
    text += fmt::format("- {}: **{}**{}\n", fact.label, fact.value,
                        fact.note.empty() ? "" : ", " + fact.note);
  for (const std::string& sentence : report.missing) text += "\n" + sentence + "\n";
  for (const Section& section : report.sections) {
    if (!HasText(section)) continue;
    text += "\n## " + section.title + "\n\n";
    if (!section.note.empty()) text += section.note + "\n\n";
    if (section.table) text += section.table->Markdown();
    for (const std::string& line : section.lines) text += "- " + line + "\n";
    for (const Command& command : section.commands)
      text += fmt::format("- {}: `{}`\n", command.what, command.command);
  }
  return text;
}

}  // namespace turbidock::report
