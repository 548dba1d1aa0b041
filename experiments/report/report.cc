#include "experiments/report/report.h"

#include <fmt/format.h>

#include <cctype>

namespace turbidock::report {
namespace {

// "pass: docking at night".
std::string Heading(const Report& report) {
  return report.verdict.word.empty() ? report.title : report.verdict.word + ": " + report.title;
}

std::string Facts(const std::vector<Fact>& facts, bool markdown) {
  std::string list = "\n";
  Table table({"<", "<", "<"});
  for (const Fact& fact : facts) {
    list += fmt::format("- {}: **{}**{}{}\n", fact.label, fact.value, fact.note.empty() ? "" : ", ",
                        fact.note);
    table.Row({fact.label, fact.value, fact.note});
  }
  return markdown ? list : table.Text();  // both begin with an empty line
}

std::string Rendered(const Report& report, bool markdown) {
  const std::string gap = markdown ? "\n" : "", item = markdown ? "- " : "";
  std::string text = (markdown ? "# " : "") + Heading(report) + "\n";
  if (!report.verdict.reason.empty()) text += gap + report.verdict.reason + "\n";
  if (!report.facts.empty()) text += Facts(report.facts, markdown);
  for (const std::string& sentence : report.missing) text += gap + sentence + "\n";
  for (const Section& section : report.sections) {
    if (!section.table && section.lines.empty() && section.facts.empty() &&
        section.commands.empty())
      continue;
    text += (markdown ? "\n## " : "\n") + section.title + "\n" + gap;
    if (!section.note.empty()) text += section.note + "\n" + gap;
    if (section.table) text += markdown ? section.table->Markdown() : section.table->Text();
    for (const std::string& line : section.lines) text += item + line + "\n";
    if (!section.facts.empty()) text += Facts(section.facts, markdown);
    for (const Command& command : section.commands)
      text += item + command.what + (markdown ? ": `" : ":\n  ") + command.command +
              (markdown ? "`\n" : "\n");
  }
  return text;
}

// Where Markdown would take a name for an element of HTML.
std::string WithoutTags(const std::string& markdown) {
  std::string text;
  bool is_code = false;
  for (size_t i = 0; i < markdown.size(); ++i) {
    is_code = markdown[i] != '\n' && is_code != (markdown[i] == '`');
    const auto next = static_cast<unsigned char>(i + 1 < markdown.size() ? markdown[i + 1] : ' ');
    if (markdown[i] == '<' && !is_code && (std::isalpha(next) || next == '/' || next == '!'))
      text += '\\';
    text += markdown[i];
  }
  return text;
}

}  // namespace

std::string Text(const Report& report) { return Rendered(report, /*markdown=*/false); }
std::string Markdown(const Report& report) {
  return WithoutTags(Rendered(report, /*markdown=*/true));
}

}  // namespace turbidock::report
