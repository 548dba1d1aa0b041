#include "experiments/report/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace turbidock::report {
namespace {

std::string MarkdownRow(const std::vector<std::string>& cells) {
  std::string row = "|";
  for (const std::string& cell : cells) {
    row += ' ';
    for (const char c : cell) {
      if (c == '|') row += '\\';
      row += c == '\n' ? ' ' : c;
    }
    row += cell.empty() ? "|" : " |";
  }
  return row;
}

// Titles, then rows.
std::vector<std::vector<std::string>> Lines(const Table& table) {
  std::vector<std::vector<std::string>> lines(1);
  for (const Table::Column& column : table.columns()) lines[0].push_back(column.title);
  for (const auto& row : table.rows()) {
    lines.emplace_back();
    for (const Cell& cell : row) lines.back().push_back(cell.text);
  }
  return lines;
}

}  // namespace

size_t Letters(const std::string& text) {
  const auto begins = [](char c) { return (c & 0xc0) != 0x80; };
  return static_cast<size_t>(std::ranges::count_if(text, begins));
}

Table::Table(const std::vector<std::string>& titles) {
  for (const std::string& title : titles) {
    const bool is_text = title.starts_with('<');
    columns_.push_back({title.substr(is_text ? 1 : 0), is_text});
  }
}

void Table::Row(std::vector<Cell> cells) {
  cells.resize(columns_.size());
  rows_.push_back(std::move(cells));
}

std::string Table::Text() const {
  const auto lines = Lines(*this);
  std::vector<size_t> widths(columns_.size());
  for (const auto& line : lines)
    for (size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], Letters(line[i]));
  std::string text;
  for (const auto& line : lines) {
    for (size_t i = 0; i < line.size(); ++i) {
      const std::string gap(widths[i] - Letters(line[i]), ' ');
      text += (i == 0 ? "" : "  ") + (columns_[i].is_text ? line[i] + gap : gap + line[i]);
    }
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  }
  return text;
}

std::string Table::Markdown() const {
  const auto lines = Lines(*this);
  std::string text = MarkdownRow(lines[0]) + "\n|";
  for (const Column& column : columns_) text += column.is_text ? "---|" : "---:|";
  for (size_t i = 1; i < lines.size(); ++i) text += "\n" + MarkdownRow(lines[i]);
  return text + "\n";
}

std::optional<double> NumberIn(const std::string& text) {
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && stop == end ? std::optional(number) : std::nullopt;
}

std::string Fixed(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

}  // namespace turbidock::report
