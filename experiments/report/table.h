#pragma once
// A table of texts, which every renderer of a report draws the same; and quantities as people read
// them: a name in the program ends in its SI unit, a person's unit may be another.

#include <optional>
#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/result_fields.h"

namespace turbidock::report {

// What a verdict, a fact or a cell says: said by a word, supported by a colour.
enum class Tone { kNone, kGood, kBad };
constexpr auto Names(Tone) {
  using enum Tone;
  return EnumList<Tone>({{kNone, "none"}, {kGood, "good"}, {kBad, "bad"}});
}

struct Cell {
  std::string text = {};
  Tone tone = Tone::kNone;
  std::string link = {};  // the id of what it opens in a page (report.h); empty: nothing

  Cell() = default;
  Cell(std::string words) : text(std::move(words)) {}  // NOLINT: a text is a cell
  Cell(const char* words) : text(words) {}             // NOLINT
  Cell(std::string words, Tone said, std::string opens = {})
      : text(std::move(words)), tone(said), link(std::move(opens)) {}
};

class Table {
 public:
  struct Column {
    std::string title;
    bool is_text = false;  // its cells begin in line; others end in line, as numbers should
  };

  // A column whose title begins with '<', which is not shown, is of text.
  explicit Table(const std::vector<std::string>& titles);

  // Missing cells at the end are empty.
  void Row(std::vector<Cell> cells);

  const std::vector<Column>& columns() const { return columns_; }
  const std::vector<std::vector<Cell>>& rows() const { return rows_; }

  std::string Text() const;      // columns two spaces apart, no spaces at the ends of lines
  std::string Markdown() const;  // bars in cells are escaped, line breaks are spaces

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<Cell>> rows_;
};

// As many as are seen: bytes that go on with a letter of UTF-8 are none.
size_t Letters(const std::string& text);

// The number that a text is as a whole, if it is one.
std::optional<double> NumberIn(const std::string& text);

// With so many digits behind the point; "-" for what is not there. No zero is below zero.
std::string Fixed(const std::optional<double>& value, int digits);

struct Quantity {
  std::string label;  // "final error true y"
  std::string unit;   // "mm"; empty where the name has none
  double factor = 1;  // of what is shown to what is stored
  TURBIDOCK_FIELDS(label, unit, factor)

  std::string Title() const { return unit.empty() ? label : label + ", " + unit; }
  // A value with its unit: "12 mm", but "5°".
  std::string Text(const std::string& value) const {
    return value + (unit.empty() || unit.starts_with("°") ? "" : " ") + unit;
  }
};

// Of a name such as "final_error_true_y_m": lengths in mm, angles in degrees.
Quantity QuantityOf(const std::string& name);

// "false lock" of the program's name "false_lock".
std::string Words(std::string name);

// A sentence about a trial without names of shapes, "hull_box" -> "hull", and keys.
std::string Spoken(const std::string& sentence);

// A number in so many significant digits at most, but all before the point of what is below a
// million.
std::string Digits(double value, int digits = 4);

// A probability of a test: 0.042, or 3.1e-05.
std::string PValue(double p);

}  // namespace turbidock::report
