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

std::string FactsOf(const Json& facts) {
  std::string text;
  for (const Json& fact : facts)
    text +=
        Element("p", fact["label"].get<std::string>() + ": " + fact["value"].get<std::string>());
  return text;
}

// Nothing where only the script has something to show.
std::string SectionOf(const Json& section) {
  std::string text;
  for (const Json& line : section["lines"]) text += Element("p", line);
  text += FactsOf(section.value("facts", Json::array()));
  for (const Json& command : section.value("commands", Json::array()))
    text += Element("p", command["what"]) + Element("pre", command["command"]);
  if (const Json& table = section["table"]; table.is_object()) text += TableOf(table);
  if (text.empty() && section["panels"].empty()) return "";
  return Element("h2", section["title"]) + Element("p", section["note"]) + text;
}

}  // namespace

std::string EscapeHtml(std::string text) {
  for (const auto& [from, to] :
       {std::pair{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}})
    boost::replace_all(text, from, to);
  return text;
}

std::string Plain(const Json& model) {
  std::string text = Element("h1", model.value("title", "turbidock"));
  if (model.contains("verdict"))
    text += Element("p", model["verdict"]["word"]) + Element("p", model["verdict"]["reason"]);
  text += Element("p", "The plots need JavaScript: this page's script has not run (yet).");
  text += FactsOf(model.value("facts", Json::array()));
  for (const Json& section : model.value("sections", Json::array())) text += SectionOf(section);
  return "<main id=\"plain\">\n" + text + "</main>\n";
}

}  // namespace turbidock::page
