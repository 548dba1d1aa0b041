#include "experiments/report/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <regex>

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

struct Unit {
  const char* ending;
  const char* shown;
  double factor = 1;
};
constexpr double kDegrees = 180 / std::numbers::pi;
// The first that fits: longer endings before those that are a part of them.
constexpr std::array kUnits = {Unit{"_newton_m", "N m"}, Unit{"_m_s", "m/s"},
                               Unit{"_kg_m2", "kg m²"},  Unit{"_kg_m3", "kg/m³"},
                               Unit{"_ml_m3", "ml/m³"},  Unit{"_rad_s", "°/s", kDegrees},
                               Unit{"_newton", "N"},     Unit{"_joule", "J"},
                               Unit{"_mps", "m/s"},      Unit{"_rad", "°", kDegrees},
                               Unit{"_deg", "°"},        Unit{"_mm", "mm"},
                               Unit{"_kg", "kg"},        Unit{"_m", "mm", 1000},
                               Unit{"_s", "s"},          Unit{"_v", "V"},
                               Unit{"_mps2", "m/s²"},    Unit{"_rad_s2", "°/s²", kDegrees},
                               Unit{"_mib", "MiB"},      Unit{"_bytes", "MB", 1e-6},
                               Unit{"_volts", "V"},      Unit{"_hz", "Hz"}};

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
  if (!value) return "-";
  std::string text = fmt::format("{:.{}f}", *value, digits);
  if (text[0] == '-' && text.find_first_not_of("-0.") == std::string::npos) text.erase(0, 1);
  return text;
}

Quantity QuantityOf(const std::string& name) {
  for (const Unit& unit : kUnits) {
    const std::string ending = unit.ending;
    if (name.ends_with(ending) && name.find("_per_") == std::string::npos)
      return {Words(name.substr(0, name.size() - ending.size())), unit.shown, unit.factor};
  }
  return {Words(name), ""};
}

std::string Words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string Spoken(const std::string& sentence) {
  static const std::regex kShape(R"(\b(hull|pole|station|dock|ball|marker)_\w+)");
  return Words(std::regex_replace(sentence, kShape, "$1"));
}

std::string Digits(double value, int digits) {
  // what rounds up to one digit more, too
  const bool is_long = std::abs(value) >= std::pow(10, digits) - 0.5 && std::abs(value) < 1e6;
  return is_long ? fmt::format("{:.0f}", value) : fmt::format("{:.{}g}", value + 0.0, digits);
}

std::string PValue(double p) {
  return p < 0.001 ? fmt::format("{:.1e}", p) : fmt::format("{:.3f}", p);
}

}  // namespace turbidock::report
