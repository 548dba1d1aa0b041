#pragma once
// Figures by gnuplot: a script with its data inside, run once.

#include <initializer_list>
#include <string>
#include <string_view>

namespace turbidock::media {

// Throws SimulatorFault when this machine cannot draw figures.
void RequireGnuplot();

// Text as a gnuplot string that means exactly that text (use with `noenhanced`).
std::string GnuplotQuoted(std::string_view text);

// Collects a script; nothing runs before WritePng.
class GnuplotScript {
 public:
  // Appends a line of gnuplot's language.
  GnuplotScript& Line(std::string_view line);

  // An inline data block: Begin("name"), rows, End; `plot $name using ...` then reads it. A gap
  // breaks lines and areas in two.
  GnuplotScript& BeginData(std::string_view name);
  GnuplotScript& Row(std::initializer_list<double> values);
  GnuplotScript& Gap();
  GnuplotScript& EndData();

  const std::string& text() const { return text_; }

  // Draws the script into a PNG. ConfigError when the path cannot be written; SimulatorFault when
  // gnuplot is missing or finds an error in the script.
  void WritePng(const std::string& path, int width_px, int height_px) const;

 private:
  std::string text_;
};

}  // namespace turbidock::media
