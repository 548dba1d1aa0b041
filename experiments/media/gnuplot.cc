#include "experiments/media/gnuplot.h"

#include <cmath>

#include "experiments/system/output_path.h"
#include "experiments/system/subprocess.h"
#include "sim/base/fields.h"

namespace turbidock::media {

void RequireGnuplot() { system::Subprocess({"gnuplot", "--version"}, "gnuplot-nox").Finish(); }

std::string GnuplotQuoted(std::string_view text) {
  // single quotes know no escapes but the doubled quote
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\n') {
      quoted += ' ';
    } else {
      quoted += c;
      if (c == '\'') quoted += c;
    }
  }
  return quoted + "'";
}

GnuplotScript& GnuplotScript::Line(std::string_view line) {
  text_.append(line).push_back('\n');
  return *this;
}

GnuplotScript& GnuplotScript::BeginData(std::string_view name) {
  text_.append("$").append(name).append(" << END_OF_DATA\n");
  return *this;
}

GnuplotScript& GnuplotScript::Row(std::initializer_list<double> values) {
  for (const double value : values)
    text_.append(std::isfinite(value) ? FormatNumber(value) : "NaN").push_back(' ');
  text_.back() = '\n';
  return *this;
}

GnuplotScript& GnuplotScript::Gap() { return Line(""); }

GnuplotScript& GnuplotScript::EndData() { return Line("END_OF_DATA"); }

void GnuplotScript::WritePng(const std::string& path, int width_px, int height_px) const {
  system::RequireWritable(path);
  // default settings: no start-up file of the user changes a figure
  system::Subprocess gnuplot({"gnuplot", "--default-settings"}, "gnuplot-nox");
  const std::string head = "set terminal pngcairo noenhanced size " + std::to_string(width_px) +
                           "," + std::to_string(height_px) + " font 'Sans,13'\nset output " +
                           GnuplotQuoted(path) + "\n";
  const std::string foot = "\nset output\n";
  for (const std::string* part : {&head, &text_, &foot})
    if (!gnuplot.Write(part->data(), part->size())) break;  // Finish says why
  gnuplot.Finish();
}

}  // namespace turbidock::media
