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

}  // namespace

Table::Table(const std::vector<std::string>& heads) : rows_(1) {
  for (const std::string& head : heads) {
    left_.push_back(head.starts_with('<'));
    rows_[0].push_back(head.substr(left_.back() ? 1 : 0));
  }
}

void Table::Row(std::vector<std::string> cells) {
  cells.resize(left_.size());
  rows_.push_back(std::move(cells));
}

std::string Table::Text() const {
  std::vector<size_t> widths(left_.size());
  for (const auto& row : rows_)
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  std::string text;
  for (const auto& row : rows_) {
    for (size_t i = 0; i < row.size(); ++i)
      text += (i == 0 ? "" : "  ") + (left_[i] ? fmt::format("{:<{}}", row[i], widths[i])
                                               : fmt::format("{:>{}}", row[i], widths[i]));
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  }
  return text;
}

std::string Table::Markdown() const {
  std::string text = MarkdownRow(rows_[0]) + "\n|";
  for (const bool left : left_) text += left ? "---|" : "---:|";
  for (size_t i = 1; i < rows_.size(); ++i) text += "\n" + MarkdownRow(rows_[i]);
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
