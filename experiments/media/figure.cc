#include "experiments/media/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <string_view>

#include "experiments/system/output_path.h"
#include "experiments/system/subprocess.h"
#include "sim/base/check.h"

namespace turbidock::media {
namespace {

using report::Axis;
using report::Block;
using report::Figure;
using report::kCurveColors;
using report::Mark;
using report::Panel;
using report::Rule;
using report::Sample;
using report::Series;

constexpr double kDotOfSize1_px = 7.5;  // gnuplot's

// Single quotes know no escapes but the doubled quote; names of ticks double '%', too.
std::string Quoted(std::string_view text, char doubled = '\'') {
  std::string quoted = "'";
  for (const char c : text) {
    quoted += c == '\n' ? ' ' : c;
    if (c == '\'' || c == doubled) quoted += c;
  }
  return quoted + "'";
}

// At most so many letters, the last of them dots where there were more.
std::string Cut(const std::string& text, size_t most) {
  if (report::Letters(text) <= most) return text;
  std::string begin;
  for (const char c : text) {
    if ((c & 0xc0) != 0x80 && report::Letters(begin) + 1 >= most) break;
    begin += c;
  }
  return begin + "…";
}

// gnuplot counts what shines through.
std::string Color(const Rgb& rgb, double opacity = 1) {
  return fmt::format("'#{:02x}{:02x}{:02x}{:02x}'", std::lround(255 * (1 - opacity)), rgb[0],
                     rgb[1], rgb[2]);
}

// How a mark is drawn: columns of the data and style, once or twice. {dashes} and {dot} are the
// curve's own.
using Layer = std::pair<const char*, const char*>;
const std::vector<Layer>& LayersOf(Mark mark) {
  static const Layer kBars{"1:2:3:4", "yerrorbars pointtype {dot}"};
  static const std::map<Mark, std::vector<Layer>> kLayers = {
      {Mark::kLine, {{"1:2", "lines {dashes}"}}},
      {Mark::kDashes, {{"1:2", "lines dashtype (8,5)"}}},
      {Mark::kDots, {{"1:2", "points pointtype {dot}"}}},
      {Mark::kRings, {{"1:2", "points pointtype 6"}}},
      {Mark::kLineWithDots, {{"1:2", "linespoints pointtype {dot}"}}},
      {Mark::kBand, {{"1:3:4", "filledcurves fillstyle transparent solid 0.18 noborder"}}},
      {Mark::kBars, {kBars}},
      {Mark::kLineWithBars, {{"1:2", "lines"}, kBars}},
      {Mark::kBarsAcross, {{"1:2:3:4", "xerrorbars pointtype {dot}"}}},
      {Mark::kNone, {}}};
  return kLayers.at(mark);
}

// Curves differ in the shape of their dots, too, and those without dots in their dashes: in grey
// their colours are alike.
struct Shape {
  int dot;
  const char* dashes;
};
const Shape& ShapeOf(const Rgb& color) {
  static constexpr std::array<Shape, kCurveColors.size()> kShapes = {
      {{7, ""},
       {5, "dashtype (14,3)"},
       {9, "dashtype (3,3)"},
       {13, "dashtype (14,3,3,3)"},
       {11, "dashtype (20,3,3,3)"},
       {15, "dashtype (9,3,9,3)"},
       {6, "dashtype (3,3,3,3,14,3)"},
       {4, "dashtype (1,3)"}}};
  const auto number = std::ranges::find(kCurveColors, color) - kCurveColors.begin();
  return kShapes[static_cast<size_t>(number) % kShapes.size()];  // any other: as the first
}

// A format of files, as gnuplot draws it: the same picture, in points where there are no pixels.
struct Terminal {
  const char* ending;
  const char* name;
  double px_per_unit;
  const char* unit;
  const char* end;  // what a whole file has within its last bytes
};
constexpr std::array kTerminals = {Terminal{".png", "pngcairo", 1, "", "IEND"},
                                   Terminal{".svg", "svg background '#ffffff'", 1, "", "</svg>"},
                                   Terminal{".pdf", "pdfcairo", 72, "in", "%%EOF"}};

const Terminal& TerminalOf(const std::string& path) {
  for (const Terminal& terminal : kTerminals)
    if (path.ends_with(terminal.ending)) return terminal;
  throw ConfigError(path + ": a figure's file ends with .png, .svg or .pdf");
}

// What gnuplot is told.
struct Script {
  std::string text;
  std::string plots;  // of the panel that is under way
  int data = 0;       // blocks so far

  template <class... Args>
  void Line(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text), format, std::forward<Args>(args)...);
    text += '\n';
  }
  void Plot(const std::string& what, const std::string& style, const std::string& name) {
    plots += fmt::format("{} with {} title {}, ", what, style, Quoted(name));
  }
};

void AddAxis(const std::string& name, const Axis& axis, bool has_data, Script* script) {
  const bool named = !axis.names.empty();
  double low = axis.low, high = axis.high;
  if (named || !has_data) {  // or gnuplot would have nothing to go by
    if (!std::isfinite(low)) low = named ? -0.6 : 0.1;
    if (!std::isfinite(high)) high = named ? static_cast<double>(axis.names.size()) - 0.4 : low + 1;
  }
  const auto limit = [](double x) { return std::isfinite(x) ? fmt::format("{}", x) : "*"; };
  script->Line("set {}range [{}:{}]", name, limit(low), limit(high));
  script->Line("set {}label {}", name, Quoted(axis.label));
  if (axis.logarithmic) script->Line("set logscale {}", name);
  if (std::isfinite(axis.tick_step)) script->Line("set {}tics {}", name, axis.tick_step);
  if (!named) return;
  std::string ticks;
  for (size_t i = 0; i < axis.names.size(); ++i)
    ticks += fmt::format("{}{} {}", i == 0 ? "" : ", ", Quoted(axis.names[i], '%'), i);
  script->Line("set {}tics ({}) {}", name, ticks, name == "x" ? "rotate by -35" : "");
  script->Line("set grid no{}tics", name);
}

void AddBlocks(const Panel& panel, Script* script) {
  const auto at = [](double value, int end) {
    return std::isfinite(value) ? fmt::format("first {}", value) : fmt::format("graph {}", end);
  };
  std::set<std::string> named{""};
  for (const Block& b : panel.blocks) {
    script->Line(
        "set object rectangle from {},{} to {},{} behind fillstyle solid {} noborder "
        "fillcolor rgb {}",
        at(b.from_x, 0), at(b.from_y, 0), at(b.to_x, 1), at(b.to_y, 1), b.opacity, Color(b.color));
    if (named.insert(b.name).second)
      script->Plot("NaN", "boxes fillstyle solid linecolor rgb " + Color(b.color), b.name);
  }
}

bool IsPoint(const Sample& sample) { return std::isfinite(sample.x) && std::isfinite(sample.y); }

void AddSeries(const Series& series, Script* script) {
  const std::string data = fmt::format("$data{}", script->data++);
  script->Line("{} << END", data);
  for (const Sample& s : series.points)
    if (IsPoint(s))
      script->Line("{} {} {} {}", s.x, s.y, s.low, s.high);
    else
      script->Line("");
  script->Line("NaN NaN NaN NaN\nEND");  // a block without a row is an error
  const std::vector<Layer>& layers = LayersOf(series.mark);
  const Shape& shape = ShapeOf(series.color);
  for (size_t i = 0; i < layers.size(); ++i) {
    const auto& [columns, style] = layers[i];
    const std::string shaped = fmt::format(fmt::runtime(style), fmt::arg("dot", shape.dot),
                                           fmt::arg("dashes", shape.dashes));
    const bool dots = shaped.find("pointtype") != std::string::npos;
    script->Plot(
        fmt::format("{} using {} axes x1y{}", data, columns, series.second_axis ? 2 : 1),
        fmt::format("{}{} linewidth {} linecolor rgb {}", shaped,
                    dots ? fmt::format(" pointsize {}", series.dot_px / kDotOfSize1_px) : "",
                    series.width_px, Color(series.color, series.opacity)),
        i + 1 == layers.size() ? series.name : "");
  }
}

void AddRule(const Rule& rule, bool has_legend, Script* script) {
  const std::string pen = fmt::format("{} linewidth {} linecolor rgb {}",
                                      rule.mark == Mark::kDashes ? " dashtype (8,5)" : "",
                                      rule.width_px, Color(rule.color));
  if (rule.is_up) {
    script->Line("set arrow from {0},graph 0 to {0},graph 1 nohead{1}", rule.at, pen);
    return;
  }
  if (rule.mark != Mark::kNone)
    script->Plot(fmt::format("{}", rule.at), "lines" + pen, has_legend ? rule.name : "");
  if (!has_legend)
    script->Line("set label {} at graph 1,first {} left offset 0.8,0 textcolor rgb {}",
                 Quoted(rule.name), rule.at, Color(rule.color));
}

// Below the panels before, all of the same size; a legend fits between two.
void Stack(const Figure& figure, size_t number, Script* script) {
  constexpr double kTop = 0.92, kBottom = 0.035, kGap = 0.016;  // of the figure's height
  const double step = (kTop - kBottom) / static_cast<double>(figure.panels.size());
  const double top = kTop - step * static_cast<double>(number);
  script->Line("set lmargin at screen 0.08; set rmargin at screen 0.925");
  script->Line("set tmargin at screen {}; set bmargin at screen {}", top, top - step + kGap);
  const Panel& panel = figure.panels[number];
  script->Line("unset title; set ylabel {}",
               Quoted(panel.y.label.empty() ? panel.title : panel.y.label));
  // in one line, of however many thrusters
  const char* const font =
      panel.series.size() > 5 ? " font ',8' samplen 1.5 width -5 maxrows 1" : "";
  if (number > 0) script->Line("set key at graph 0, graph 1.04 left bottom{}", font);
  if (number + 1 < figure.panels.size()) script->Line("set format x ''; unset xlabel");
}

void AddPanel(const Figure& figure, size_t number, Script* script) {
  const Panel& panel = figure.panels[number];
  script->Line("reset");
  script->Line("set border linewidth 1 linecolor rgb '#6b747c'");
  script->Line("set tics nomirror scale 0.6 textcolor rgb '#20262b'");
  script->Line("set grid linetype 1 linewidth 0.6 linecolor rgb '#d4d9de'");
  script->Line("set title {}", Quoted(panel.title));
  const auto has_data = [&](bool second) {
    return std::any_of(panel.series.begin(), panel.series.end(), [&](const Series& series) {
      return series.second_axis == second &&
             std::any_of(series.points.begin(), series.points.end(), IsPoint);
    });
  };
  AddAxis("x", panel.x, has_data(false) || has_data(true), script);
  AddAxis("y", panel.y, has_data(false), script);
  AddAxis("y2", panel.y2, has_data(true), script);
  if (has_data(true)) script->Line("set y2tics; set rmargin 9");
  if (panel.equal) script->Line("set size ratio -1");

  // panels above each other have the same margins
  if (panel.y.names.empty()) script->Line("set lmargin 10");
  script->Line("set key tmargin left horizontal Left reverse samplen 3");
  if (figure.stacked) Stack(figure, number, script);
  if (!panel.legend) script->Line("unset key");

  script->plots.clear();
  for (const Series& series : panel.series) AddSeries(series, script);
  for (const Rule& rule : panel.rules) AddRule(rule, panel.legend && !figure.stacked, script);
  AddBlocks(panel, script);
  script->Line("plot {}NaN notitle", script->plots);
}

}  // namespace

void RequireFigures() { system::Subprocess({"gnuplot", "--version"}, "gnuplot-nox").Finish(); }

void RequireFigurePath(const std::string& path) { TerminalOf(path); }

void WriteFigure(const std::string& path, const Figure& figure) {
  const Terminal& terminal = TerminalOf(path);
  system::WholeFile file(path);
  const size_t columns = figure.columns;
  const size_t rows = (figure.panels.size() + columns - 1) / columns;
  // as large as fits; what would be too small to read is cut
  constexpr double kLeastSize = 9;
  const double room = 1.2 * static_cast<double>(columns) * figure.width_px;
  const std::string words = Cut(figure.title, static_cast<size_t>(room / kLeastSize) - 1);
  const double most = room / static_cast<double>(report::Letters(words) + 1);
  const std::string title = words.empty() ? ""
                                          : fmt::format("title {} font 'Sans Bold,{}'",
                                                        Quoted(words), std::min(15.0, most));
  Script script;
  const auto size = [&](size_t px) { return static_cast<double>(px) / terminal.px_per_unit; };
  script.Line("set terminal {} noenhanced size {}{},{}{} font 'Sans,13'", terminal.name,
              size(columns * static_cast<size_t>(figure.width_px)), terminal.unit,
              size(rows * static_cast<size_t>(figure.height_px) + (title.empty() ? 0 : 40)),
              terminal.unit);
  script.Line("set output {}", Quoted(file.partial()));
  script.Line("set encoding utf8");
  script.Line("set multiplot layout {},{} {}", rows, columns, title);
  for (size_t i = 0; i < figure.panels.size(); ++i) AddPanel(figure, i, &script);
  script.Line("unset multiplot; set output");
  // default settings: no start-up file of the user changes a figure
  system::Subprocess gnuplot({"gnuplot", "--default-settings"}, "gnuplot-nox");
  gnuplot.Write(script.text.data(), script.text.size());  // Finish says why it could not
  gnuplot.FinishWriting(path);
  // It says nothing when the disk is full.
  const std::string written = system::ReadWhole(file.partial());
  if (written.find(terminal.end, written.size() - std::min<size_t>(written.size(), 64)) ==
      std::string::npos)
    throw ConfigError(path, "cannot be written: No space left on device");
  file.Commit();
}

Figure FigureOf(const report::Report& report) {
  const std::string& word = report.verdict.word;
  Figure figure{.title = word.empty() ? report.title : word + ": " + report.title,
                .width_px = 560,
                .height_px = 460};
  figure.stacked = std::ranges::all_of(report.sections, [](const report::Section& section) {
    return section.stacked || section.panels.empty();
  });
  std::set<size_t> rows;                         // how many plots a section has
  std::set<std::vector<std::string>> explained;  // by a legend further up in a stack
  for (const report::Section& section : report.sections) {
    if (section.panels.empty()) continue;
    rows.insert(section.panels.size());
    for (const Panel& panel : section.panels) {
      figure.panels.push_back(panel);
      if (panel.title.empty()) figure.panels.back().title = section.title;
      std::vector<std::string> names;
      for (const Series& series : panel.series)
        if (!series.name.empty()) names.push_back(series.name);
      figure.panels.back().legend |=
          names.size() > 1 && (!figure.stacked || explained.insert(names).second);
    }
  }
  if (figure.stacked && !rows.empty()) {
    figure.width_px = 1400;
    figure.height_px = 195;
    return figure;
  }
  const bool is_row = rows.size() == 1 && *rows.begin() > 1 && *rows.begin() <= 4;
  figure.columns = is_row ? *rows.begin() : std::clamp<size_t>(figure.panels.size(), 1, 3);
  return figure;
}

}  // namespace turbidock::media
