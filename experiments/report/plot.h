#pragma once
// Plots as values: what is drawn and what it means. media/figure.h draws them into files, the
// page's scripts on a screen; neither knows what they are of.

#include <array>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/image.h"
#include "sim/base/result_fields.h"

namespace turbidock::report {

// No value: a gap in a series; of an axis, as far as the data go; of a block, as far as the panel.
inline constexpr double kOpen = std::numeric_limits<double>::quiet_NaN();

// Colours of curves in their order, told apart without red and green, too; they repeat.
inline constexpr std::array kCurveColors{Rgb{0, 114, 178},   Rgb{213, 94, 0},  Rgb{0, 158, 115},
                                         Rgb{204, 121, 167}, Rgb{230, 159, 0}, Rgb{86, 180, 233},
                                         Rgb{122, 79, 176},  Rgb{70, 78, 86}};
inline constexpr Rgb kGrey{140, 148, 156};
inline constexpr const Rgb& CurveColor(size_t i) { return kCurveColors[i % kCurveColors.size()]; }

struct Sample {
  double x = kOpen, y = kOpen;
  double low = kOpen, high = kOpen;  // ends of a band or bar
};

// Bars have a dot at y, and are of y; those across of x.
enum class Mark {
  kLine,
  kDashes,
  kDots,
  kRings,
  kLineWithDots,
  kBand,
  kBars,
  kLineWithBars,
  kBarsAcross,
  kNone
};
constexpr auto Names(Mark) {
  using enum Mark;
  return EnumList<Mark>({{kLine, "line"},
                         {kDashes, "dashes"},
                         {kDots, "dots"},
                         {kRings, "rings"},
                         {kLineWithDots, "line_with_dots"},
                         {kBand, "band"},
                         {kBars, "bars"},
                         {kLineWithBars, "line_with_bars"},
                         {kBarsAcross, "bars_across"},
                         {kNone, "none"}});
}

struct Series {
  std::string name = {};            // in the legend, unless empty
  std::vector<Sample> points = {};  // a gap where x or y is not finite
  Rgb color = kCurveColors[0];
  Mark mark = Mark::kLine;
  double width_px = 2, dot_px = 6;
  bool second_axis = false;  // y belongs to the panel's y2
  double opacity = 1;
  // Empty, or for each point what it opens in a page: the id of a link (report.h).
  std::vector<std::string> links = {};
};

// A straight line through the whole panel: across at a y, or up at an x. The name of one across is
// in the legend, or beside the panel where it has none.
struct Rule {
  double at = 0;
  std::string name = {};
  Rgb color = kGrey;
  Mark mark = Mark::kDashes;  // a line, dashes or none
  double width_px = 1.4;
  bool is_up = false;
  TURBIDOCK_FIELDS(at, name, color, mark, is_up)
};

// A shaded rectangle behind all else. Its name stands in the legend.
struct Block {
  std::string name = {};
  double from_x = kOpen, to_x = kOpen, from_y = kOpen, to_y = kOpen;
  Rgb color = kGrey;
  double opacity = 1;
  TURBIDOCK_FIELDS(name, from_x, to_x, from_y, to_y, color, opacity)
};

struct Axis {
  std::string label = {};
  double low = kOpen, high = kOpen;  // downwards or leftwards where low > high
  bool logarithmic = false;
  double tick_step = kOpen;
  std::vector<std::string> names = {};  // at 0, 1, 2, ... in place of numbers
  TURBIDOCK_FIELDS(label, low, high, logarithmic, names)
};

struct Panel {
  std::string title = {};
  Axis x = {}, y = {}, y2 = {};
  std::vector<Block> blocks = {};
  std::vector<Series> series = {};  // later ones on top
  std::vector<Rule> rules = {};
  bool legend = false;
  bool equal = false;  // a length is as long on x as on y
  TURBIDOCK_FIELDS(title, x, y, y2, blocks, series, rules, legend, equal)
};

struct Figure {
  std::string title = {};
  size_t columns = 1;
  bool stacked = false;                  // in one column close together, over one x axis
  int width_px = 1100, height_px = 700;  // of a column and of a row
  std::vector<Panel> panels = {};        // row by row
};

// A sample for each element of a range: `of(element)`; or x and y of it, functions or members.
template <class Range, class Of>
std::vector<Sample> SamplesOf(const Range& range, Of of) {
  std::vector<Sample> samples;
  samples.reserve(std::size(range));
  for (const auto& element : range) samples.push_back(of(element));
  return samples;
}
template <class Range, class X, class Y>
std::vector<Sample> SamplesOf(const Range& range, X x, Y y) {
  return SamplesOf(range, [&](const auto& element) {
    return Sample{static_cast<double>(std::invoke(x, element)),
                  static_cast<double>(std::invoke(y, element))};
  });
}

// An interval about y, all times `unit`.
template <class Interval>
Sample SampleWithin(double x, double y, const Interval& interval, double unit = 1) {
  return {x, unit * y, unit * interval.low, unit * interval.high};
}

// Both ends and what lies evenly between them, steps + 1 numbers.
inline std::vector<double> Evenly(double from, double to, int steps) {
  std::vector<double> values;
  for (int i = 0; i <= steps; ++i) values.push_back(from + (to - from) * i / steps);
  return values;
}

}  // namespace turbidock::report
