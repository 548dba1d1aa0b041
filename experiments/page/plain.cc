#include "experiments/page/plain.h"

#include <fmt/format.h>

#include <boost/algorithm/string/replace.hpp>
#include <string_view>
#include <utility>

namespace turbidock::page {
namespace {

using report::Json;

std::string Element(const std::string& tag, const Json& text) {
  const std::string words = text.is_string() ? text.get<std::string>() : "";
  return words.empty() ? "" : fmt::format("<{0}>{1}</{0}>\n", tag, EscapeHtml(words));
}

// A cell is a text, or has one.
std::string Row(const std::string& tag, const Json& cells, const char* text) {
  std::string row = "<tr>";
  for (const Json& cell : cells)
    row += fmt::format("<{0}>{1}</{0}>", tag,
                       EscapeHtml((cell.is_string() ? cell : cell.at(text)).get<std::string>()));
  return row + "</tr>\n";
}

std::string TableOf(const Json& table) {
  std::string rows;
  for (const Json& row : table["rows"]) rows += Row("td", row, "text");
  return "<table>\n" + Row("th", table["columns"], "label") + rows + "</table>\n";
}

std::string SectionOf(const Json& section) {
  std::string text = Element("h2", section["title"]) + Element("p", section["note"]);
  for (const Json& line : section["lines"]) text += Element("p", line);
  if (const Json& table = section["table"]; table.is_object()) text += TableOf(table);
  return text;
}

}  // namespace

std::string EscapeHtml(std::string text) {
  for (const auto& [from, to] :
       {std::pair{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}})
    boost::replace_all(text, from, to);
  return text;
}

std::string Plain(const Json& model) {
  const Json& report = model.contains("report") ? model["report"] : model;
  std::string text = Element("h1", model.value("title", "turbidock"));
  if (report.contains("verdict"))
    text += Element("p", report["verdict"]["word"]) + Element("p", report["verdict"]["reason"]);
  if (model.contains("record"))  // a trial's
    text += Element("p", model["record"]["outcome"]) + Element("p", model["record"]["reason"]);
  text += Element("p", "The plots need JavaScript: this page's script has not run (yet).");
  for (const Json& fact : report.value("facts", Json::array()))
    text +=
        Element("p", fact["label"].get<std::string>() + ": " + fact["value"].get<std::string>());
  for (const Json& section : report.value("sections", Json::array())) text += SectionOf(section);
  return "<main id=\"plain\">\n" + text + "</main>\n";
}

}  // namespace turbidock::page
