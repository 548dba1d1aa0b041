#pragma once
// Tables for people: aligned for a terminal, or as Markdown; and the words of their cells.

#include <optional>
#include <string>
#include <vector>

namespace turbidock::report {

class Table {
 public:
  // Cells begin in line under a head that begins with '<', which is not shown; the others end in
  // line, as numbers should.
  explicit Table(const std::vector<std::string>& heads);

  void Row(std::vector<std::string> cells);

  std::string Text() const;      // columns two spaces apart, no spaces at the ends of lines
  std::string Markdown() const;  // bars in cells are escaped, line breaks are spaces

 private:
  std::vector<bool> left_;                      // by column
  std::vector<std::vector<std::string>> rows_;  // the first has the heads
};

// The number that a text is as a whole, if it is one.
std::optional<double> NumberIn(const std::string& text);

// With so many digits behind the point; "-" for what is not there.
std::string Fixed(const std::optional<double>& value, int digits);

}  // namespace turbidock::report
