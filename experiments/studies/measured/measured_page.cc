#include "experiments/studies/measured/measured_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "experiments/config/nearest_name.h"
#include "experiments/report/table.h"
#include "experiments/system/output_path.h"
#include "sim/base/check.h"

namespace turbidock::measured {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBegin = "<!-- measured ", kClose = " -->",
                           kEnd = "<!-- end measured -->";
constexpr std::string_view kNotRecorded = "not recorded";

struct Line {
  std::string text, ending;  // ending: "\n", "\r\n" or, at the end of a file, nothing
};

std::vector<Line> SplitLines(const std::string& text) {
  std::vector<Line> lines;
  for (size_t at = 0; at < text.size();) {
    const size_t newline = text.find('\n', at);
    const size_t after = newline == std::string::npos ? text.size() : newline + 1;
    size_t end = std::min(newline, text.size());
    if (newline != std::string::npos && end > at && text[end - 1] == '\r') --end;
    lines.push_back({text.substr(at, end - at), text.substr(end, after - end)});
    at = after;
  }
  return lines;
}

[[noreturn]] void Fail(const std::string& file, size_t line, const std::string& problem) {
  throw ConfigError(fmt::format("{}:{}: {}", file, line, problem));
}

std::vector<std::string> ParseRow(const std::string& text, const std::string& file, size_t line) {
  std::vector<std::string> cells(1);
  bool quoted = false, closed = false;  // inside quotes; behind the closing one
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '"') {
      const bool doubled = i + 1 < text.size() && text[i + 1] == '"';
      quoted = doubled;
      closed = !doubled;
      if (doubled) cells.back() += text[++i];
    } else if (!quoted && c == ',') {
      cells.emplace_back();
      closed = false;
    } else if (closed) {
      Fail(file, line, "text after a closing quote");
    } else if (!quoted && c == '"') {
      if (!cells.back().empty())
        Fail(file, line, "a quote inside a cell that does not begin with one");
      quoted = true;
    } else {
      cells.back() += c;
    }
  }
  if (quoted) Fail(file, line, "a quote is not closed on its line");
  return cells;
}

// "# key: value" into the table.
void ReadOrigin(const std::string& text, const std::string& file, size_t line, Table* table) {
  const std::map<std::string, std::string*> singles = {{"title", &table->title},
                                                       {"build", &table->build},
                                                       {"machine", &table->machine},
                                                       {"date", &table->date}};
  const size_t colon = text.find(": ");
  if (!text.starts_with("# ") || colon == std::string::npos || colon + 2 == text.size())
    Fail(file, line, "must be \"# key: value\"");
  const std::string key = text.substr(2, colon - 2), value = text.substr(colon + 2);
  if (key == "command") {
    table->commands.push_back(value);
    return;
  }
  const auto single = singles.find(key);
  if (single == singles.end())
    Fail(file, line,
         "unknown key " + key +
             config::DidYouMean(key, {"title", "command", "build", "machine", "date"}));
  if (!single->second->empty()) Fail(file, line, key + " is given twice");
  *single->second = value;
}

void RequireOrigin(const Table& table, const std::string& file, size_t line) {
  const std::pair<const char*, bool> keys[] = {{"title", table.title.empty()},
                                               {"command", table.commands.empty()},
                                               {"build", table.build.empty()},
                                               {"machine", table.machine.empty()},
                                               {"date", table.date.empty()}};
  for (const auto& [key, missing] : keys)
    if (missing)
      Fail(file, line,
           fmt::format("no \"# {}: ...\" before the table (write \"{}\" where it is not known)",
                       key, kNotRecorded));
}

std::string CodeSpan(const std::string& text) {
  return text.find('`') == std::string::npos ? "`" + text + "`" : "`` " + text + " ``";
}

// Where a page shows a table: `begin` and `end` are the indices of its two marker lines.
struct Block {
  std::string name;
  size_t begin = 0, end = 0;
};

std::vector<Block> FindBlocks(const std::vector<Line>& lines, const std::string& page) {
  std::vector<Block> blocks;
  bool open = false, fenced = false;
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string& text = lines[i].text;
    if (text.starts_with("```")) fenced = !fenced;
    if (fenced) continue;
    if (text.starts_with(kBegin) && text.ends_with(kClose)) {
      if (open) break;
      open = true;
      blocks.push_back(
          {text.substr(kBegin.size(), text.size() - kBegin.size() - kClose.size()), i, i});
    } else if (text == kEnd) {
      if (!open) Fail(page, i + 1, fmt::format("{} without a beginning", kEnd));
      blocks.back().end = i;
      open = false;
    }
  }
  if (open)
    Fail(page, blocks.back().begin + 1,
         fmt::format("table {} has no {} of its own", blocks.back().name, kEnd));
  return blocks;
}

const Table& TableOf(const Block& block, const std::string& page, const Tables& tables) {
  const auto found = tables.find(block.name);
  if (found != tables.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& [name, table] : tables) known.push_back(name);
  Fail(page, block.begin + 1,
       "no result file " + block.name + ".csv" + config::DidYouMean(block.name, known));
}

}  // namespace

Table ParseTable(const std::string& text, const std::string& file) {
  Table table;
  const std::vector<Line> lines = SplitLines(text);
  size_t i = 0;
  for (; i < lines.size() && lines[i].text.starts_with("#"); ++i)
    ReadOrigin(lines[i].text, file, i + 1, &table);
  RequireOrigin(table, file, i + 1);
  if (i == lines.size()) Fail(file, i + 1, "no row that names the columns");
  for (const size_t header = i; i < lines.size(); ++i) {
    if (lines[i].text.empty()) Fail(file, i + 1, "an empty line");
    std::vector<std::string> cells = ParseRow(lines[i].text, file, i + 1);
    if (i == header)
      table.columns = std::move(cells);
    else if (cells.size() != table.columns.size())
      Fail(file, i + 1,
           fmt::format("{} cells under {} columns", cells.size(), table.columns.size()));
    else
      table.rows.push_back(std::move(cells));
  }
  if (table.rows.empty()) Fail(file, i + 1, "no rows under the columns' names");
  return table;
}

Tables LoadTables(const std::string& folder) {
  std::error_code error;
  Tables tables;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".csv") continue;
    tables[entry.path().stem().string()] =
        ParseTable(system::ReadWhole(entry.path()), entry.path().string());
  }
  if (error) throw ConfigError(folder + ": " + error.message());
  return tables;
}

std::vector<std::string> MarkdownLines(const Table& table) {
  std::vector<std::string> lines = {report::MarkdownRow(table.columns), "|"};
  for (size_t i = 0; i < table.columns.size(); ++i) lines.back() += "---|";
  for (const auto& row : table.rows) lines.push_back(report::MarkdownRow(row));
  std::string origin = table.title + ".";
  for (const std::string& command : table.commands)
    origin += command == kNotRecorded ? " Command: not recorded."
                                      : fmt::format(" {}.", CodeSpan(command));
  origin +=
      fmt::format(" Build: {}; machine: {}; date: {}.", table.build, table.machine, table.date);
  lines.emplace_back();
  lines.push_back(origin);
  return lines;
}

std::string DrawPage(const std::string& text, const std::string& page, const Tables& tables) {
  const std::vector<Line> lines = SplitLines(text);
  std::string drawn;
  size_t at = 0;
  const auto copy_to = [&](size_t end) {
    for (; at < end; ++at) drawn.append(lines[at].text).append(lines[at].ending);
  };
  for (const Block& block : FindBlocks(lines, page)) {
    copy_to(block.begin + 1);
    for (const std::string& line : MarkdownLines(TableOf(block, page, tables)))
      drawn.append(line).append(lines[block.begin].ending);
    at = block.end;
  }
  copy_to(lines.size());
  return drawn;
}

std::vector<std::string> Differences(const std::string& text, const std::string& page,
                                     const Tables& tables) {
  const std::vector<Line> lines = SplitLines(text);
  std::vector<std::string> differences;
  for (const Block& block : FindBlocks(lines, page)) {
    const std::vector<std::string> expected = MarkdownLines(TableOf(block, page, tables));
    const size_t shown = block.end - block.begin - 1;
    for (size_t i = 0; i < std::max(shown, expected.size()); ++i) {
      const std::string on_page = i < shown ? lines[block.begin + 1 + i].text : "(nothing)";
      const std::string in_file = i < expected.size() ? expected[i] : "(nothing)";
      if (i < shown && i < expected.size() && on_page == in_file) continue;
      differences.push_back(
          fmt::format("{}:{}: table {} differs from its file\n  page: {}\n  file: {}", page,
                      block.begin + 2 + i, block.name, on_page, in_file));
      break;
    }
  }
  return differences;
}

std::vector<std::string> TablesShown(const std::string& text, const std::string& page) {
  std::vector<std::string> names;
  for (const Block& block : FindBlocks(SplitLines(text), page)) names.push_back(block.name);
  return names;
}

}  // namespace turbidock::measured
