#include "experiments/studies/run/trial_figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <utility>
#include <vector>

#include "experiments/media/gnuplot.h"
#include "experiments/trial/trial_files.h"
#include "sim/base/check.h"
#include "sim/base/fields.h"
#include "sim/base/units.h"

namespace turbidock::run {
namespace {

using control::Stage;
using units::DegFromRad;
using units::MmFromM;

// Where things stand, as fractions of the figure.
constexpr double kLeft = 0.080, kRight = 0.925;
constexpr double kTitleRow = 0.982, kOutcomeRow = 0.963, kLegendRow = 0.942;
constexpr double kBarTop = 0.928, kBarBottom = 0.908;
constexpr double kPanelsTop = 0.900, kPanelsBottom = 0.045;
constexpr double kPanelGap = 0.014;
constexpr int kPanels = 5;
constexpr double kCharWidth = 0.0068;  // of the stages' labels, roughly

constexpr const char* kDashType = "dashtype (8,5)";  // of the desired values
constexpr Rgb kInk{70, 78, 86};
constexpr double kLowestF = -0.25, kHighestF = 1.02;

// One quantity of a panel, in the panel's unit.
using Quantity = std::function<double(const trial::FrameRecord&)>;

struct Panel {
  const char* label;
  Quantity estimate, truth = nullptr, desired = nullptr;
  double band = 0;                                           // > 0: shaded about the desired value
  double least_span = 0;                                     // of the vertical axis
  std::vector<std::pair<double, std::string>> limits = {};   // lines and what they are
  std::vector<std::pair<double, std::string>> remarks = {};  // words beside a value
};

std::string Number(double x) { return FormatNumber(x); }

std::string Color(const Rgb& rgb) {
  char text[16];
  std::snprintf(text, sizeof text, "'#%02x%02x%02x'", rgb[0], rgb[1], rgb[2]);
  return text;
}

// A run of frames of one stage.
struct StageSpan {
  Stage stage;
  double start_s, end_s;
};

std::vector<StageSpan> StageSpans(const trial::TrialLog& log) {
  std::vector<StageSpan> spans;
  for (const trial::FrameRecord& frame : log.frames) {
    if (spans.empty() || spans.back().stage != frame.stage) {
      if (!spans.empty()) spans.back().end_s = frame.time_s;
      spans.push_back({frame.stage, frame.time_s, frame.time_s});
    }
    spans.back().end_s = frame.time_s;
  }
  return spans;
}

// The bar above the panels: every stage is named in its longest band, or in the legend where it is
// too short for its name.
void DrawStageBar(const std::vector<StageSpan>& spans, double end_s, media::GnuplotScript* script) {
  const auto column = [&](double time_s) { return kLeft + (kRight - kLeft) * time_s / end_s; };
  for (const StageSpan& span : spans)
    script->Line("set object rectangle from screen " + Number(column(span.start_s)) + "," +
                 Number(kBarBottom) + " to screen " + Number(column(span.end_s)) + "," +
                 Number(kBarTop) + " fillstyle solid noborder fillcolor rgb " +
                 Color(trial::kOnPaper.Of(span.stage)));
  double legend = kRight;
  for (const Stage stage :
       {Stage::kDocked, Stage::kDocking, Stage::kVisualServoing, Stage::kApproach}) {
    const StageSpan* longest = nullptr;
    for (const StageSpan& span : spans)
      if (span.stage == stage &&
          (!longest || span.end_s - span.start_s > longest->end_s - longest->start_s))
        longest = &span;
    if (!longest) continue;
    const std::string name = trial::StageTitle(stage);
    const double width = kCharWidth * static_cast<double>(name.size());
    const double from = column(longest->start_s), to = column(longest->end_s);
    if (to - from > 1.15 * width) {
      script->Line("set label " + media::GnuplotQuoted(name) + " at screen " +
                   Number((from + to) / 2) + "," + Number((kBarTop + kBarBottom) / 2) +
                   " center front textcolor rgb 'white'");
    } else {
      script->Line("set label " + media::GnuplotQuoted(name) + " at screen " + Number(legend) +
                   "," + Number(kLegendRow) + " right textcolor rgb " +
                   Color(trial::kOnPaper.Of(stage)));
      legend -= width + 0.02;
    }
  }
}

enum class Mark { kLine, kDashes, kDots, kArea };

// The legend of the curves, left to right above the bar.
void DrawLegend(const trial::ViewCriteria& criteria, media::GnuplotScript* script) {
  double x = kLeft;
  char weak[64];
  std::snprintf(weak, sizeof weak, "estimate, F < %.2f", criteria.detection_fitness);
  const auto entry = [&](const std::string& text, Mark mark, const Rgb& color) {
    const std::string y = Number(kLegendRow);
    if (mark == Mark::kDots) {
      for (const double dx : {0.006, 0.014, 0.022})
        script->Line("set label '' at screen " + Number(x + dx) + "," + y +
                     " point pointtype 7 pointsize 0.5 linecolor rgb " + Color(color));
    } else if (mark == Mark::kArea) {
      script->Line("set object rectangle from screen " + Number(x) + "," +
                   Number(kLegendRow - 0.005) + " to screen " + Number(x + 0.028) + "," +
                   Number(kLegendRow + 0.005) + " fillstyle solid 0.18 noborder fillcolor rgb " +
                   Color(color));
    } else {
      script->Line("set arrow from screen " + Number(x) + "," + y + " to screen " +
                   Number(x + 0.028) + "," + y + " nohead linewidth 2.5 " +
                   (mark == Mark::kDashes ? kDashType : "") + " linecolor rgb " + Color(color));
    }
    script->Line("set label " + media::GnuplotQuoted(text) + " at screen " + Number(x + 0.034) +
                 "," + y + " left");
    x += 0.034 + 0.0078 * static_cast<double>(text.size()) + 0.022;
  };
  entry("estimate", Mark::kLine, trial::kOnPaper.estimate);
  entry(weak, Mark::kDots, trial::kOnPaper.estimate);
  entry("truth", Mark::kLine, trial::kOnPaper.truth);
  entry("desired", Mark::kDashes, trial::kOnPaper.desired);
  entry("desired " + trial::BandText(criteria), Mark::kArea, trial::kOnPaper.limit);
}

// Data blocks $line0, $weak0, $truth0, $desired0, $band0 of panel 0, and so on.
void WriteData(const trial::TrialLog& log, const Panel& panel, int number, double detection_fitness,
               media::GnuplotScript* script) {
  const std::string suffix = std::to_string(number);
  // the rows of the frames for which `keep` holds; a gap between its runs
  const auto block = [&](const char* name, auto&& keep, auto&& write) {
    script->BeginData(name + suffix);
    bool open = false;
    for (const trial::FrameRecord& frame : log.frames) {
      if (keep(frame))
        write(frame);
      else if (open)
        script->Gap();
      open = keep(frame);
    }
    // a block without a row is an error to gnuplot
    script->Row({std::nan(""), std::nan(""), std::nan("")}).EndData();
  };
  const auto always = [](const trial::FrameRecord&) { return true; };
  const auto detected = [&](const trial::FrameRecord& f) { return f.fitness >= detection_fitness; };
  const auto point = [&](const Quantity& quantity) {
    return [&](const trial::FrameRecord& f) { script->Row({f.time_s, quantity(f)}); };
  };
  if (panel.truth) {
    block("line", detected, point(panel.estimate));
    block("weak", std::not_fn(detected), point(panel.estimate));
    block("truth", always, point(panel.truth));
    const auto controlled = [](const trial::FrameRecord& f) { return f.controlled; };
    block("desired", controlled, point(panel.desired));
    if (panel.band > 0)
      block("band", controlled, [&](const trial::FrameRecord& f) {
        script->Row({f.time_s, panel.desired(f) - panel.band, panel.desired(f) + panel.band});
      });
  } else {
    block("line", always, point(panel.estimate));
  }
}

// A vertical range that holds everything but the estimates of frames without detection.
std::pair<double, double> VerticalRange(const trial::TrialLog& log, const Panel& panel,
                                        double detection_fitness) {
  double low = INFINITY, high = -INFINITY;
  const auto hold = [&](double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  };
  for (const trial::FrameRecord& frame : log.frames) {
    hold(panel.truth(frame));
    if (frame.fitness >= detection_fitness) hold(panel.estimate(frame));
    if (!frame.controlled) continue;
    hold(panel.desired(frame) - panel.band);
    hold(panel.desired(frame) + panel.band);
  }
  for (const auto& [value, text] : panel.limits) hold(value);
  if (low > high) low = high = 0;
  // a tenth more than needed
  const double half = std::max(0.55 * (high - low), 0.5 * panel.least_span);
  const double middle = (low + high) / 2;
  return {middle - half, middle + half};
}

void DrawPanel(const Panel& panel, int number, const trial::TrialLog& log,
               const std::vector<StageSpan>& spans, const FigureInfo& info,
               media::GnuplotScript* script) {
  const std::string suffix = std::to_string(number);
  const double height = (kPanelsTop - kPanelsBottom - (kPanels - 1) * kPanelGap) / kPanels;
  const double top = kPanelsTop - number * (height + kPanelGap);
  script->Line("set tmargin at screen " + Number(top));
  script->Line("set bmargin at screen " + Number(top - height));
  script->Line("set ylabel " + media::GnuplotQuoted(panel.label) + " offset 0.5,0");
  const bool last = number == kPanels - 1;
  script->Line(last ? "set format x '%g'" : "set format x ''");
  script->Line(last ? "set xlabel 'time [s]' offset 0,0.6" : "unset xlabel");

  for (const StageSpan& span : spans) {
    script->Line("set object rectangle from first " + Number(span.start_s) + ", graph 0 to first " +
                 Number(span.end_s) +
                 ", graph 1 behind fillstyle solid 0.10 noborder fillcolor rgb " +
                 Color(trial::kOnPaper.Of(span.stage)));
    if (span.start_s > spans.front().start_s)
      script->Line("set arrow from first " + Number(span.start_s) + ", graph 0 to first " +
                   Number(span.start_s) + ", graph 1 nohead back linewidth 1 linecolor rgb " +
                   Color(trial::kOnPaper.Of(span.stage)));
  }

  const double detection = info.criteria.detection_fitness;
  const auto [low, high] =
      panel.truth ? VerticalRange(log, panel, detection) : std::pair(kLowestF, kHighestF);
  script->Line("set yrange [" + Number(low) + ":" + Number(high) + "]");
  // beside the panel, where no curve can run through the words
  const auto remark = [&](double value, const std::string& text, const Rgb& color) {
    script->Line("set label " + media::GnuplotQuoted(text) + " at graph 1.008, first " +
                 Number(value) + " left textcolor rgb " + Color(color));
  };
  for (const auto& [value, text] : panel.limits) {
    script->Line("set arrow from graph 0, first " + Number(value) + " to graph 1, first " +
                 Number(value) + " nohead front linewidth 1.4 linecolor rgb " +
                 Color(trial::kOnPaper.limit));
    remark(value, text, trial::kOnPaper.limit);
  }
  for (const auto& [value, text] : panel.remarks) remark(value, text, kInk);

  // the truth is broad, so that it shows on both sides of a good estimate
  const std::string estimate = "$line" + suffix +
                               " using 1:2 with lines linewidth 1.4 linecolor rgb " +
                               Color(trial::kOnPaper.estimate);
  if (panel.truth) {
    std::string plot = "plot ";
    if (panel.band > 0)
      plot += "$band" + suffix +
              " using 1:2:3 with filledcurves fillstyle solid 0.18 noborder fillcolor rgb " +
              Color(trial::kOnPaper.limit) + ", ";
    plot += "$desired" + suffix + " using 1:2 with lines linewidth 1.8 " + kDashType +
            " linecolor rgb " + Color(trial::kOnPaper.desired) + ", $truth" + suffix +
            " using 1:2 with lines linewidth 4 linecolor rgb " + Color(trial::kOnPaper.truth) +
            ", $weak" + suffix + " using 1:2 with points pointtype 7 pointsize 0.3 linecolor rgb " +
            Color(trial::kOnPaper.estimate) + ", " + estimate;
    script->Line(plot);
  } else {
    script->Line("plot " + estimate);
  }
  script->Line("unset object").Line("unset arrow").Line("unset label");
}

std::vector<Panel> Panels(const trial::ViewCriteria& criteria) {
  char docking[16], detection[16], docked[16];
  std::snprintf(docking, sizeof docking, "%.2f", criteria.docking_fitness);
  std::snprintf(detection, sizeof detection, "%.2f", criteria.detection_fitness);
  std::snprintf(docked, sizeof docked, "%.0f mm", MmFromM(criteria.docked_x_m));
  const double y_band_mm = MmFromM(criteria.tolerance_y_m);
  const double z_band_mm = MmFromM(criteria.tolerance_z_m);
  using F = trial::FrameRecord;
  return {
      {.label = "F",
       .estimate = [](const F& f) { return f.fitness; },
       .limits = {{criteria.docking_fitness, docking}, {criteria.detection_fitness, detection}},
       .remarks = {{(kHighestF + criteria.docking_fitness) / 2, "Area I"},
                   {(criteria.docking_fitness + criteria.detection_fitness) / 2, "Area II"},
                   {(criteria.detection_fitness + kLowestF) / 2, "Area III"}}},
      {.label = "x [mm]",
       .estimate = [](const F& f) { return MmFromM(f.est_X_HM.p.x()); },
       .truth = [](const F& f) { return MmFromM(f.true_X_HM.p.x()); },
       .desired = [](const F& f) { return MmFromM(f.desired.x_m); },
       .least_span = 100,
       .limits = {{MmFromM(criteria.docked_x_m), docked}}},
      {.label = "y [mm]",
       .estimate = [](const F& f) { return MmFromM(f.est_X_HM.p.y()); },
       .truth = [](const F& f) { return MmFromM(f.true_X_HM.p.y()); },
       .desired = [](const F& f) { return MmFromM(f.desired.y_m); },
       .band = y_band_mm,
       .least_span = 3 * y_band_mm},
      {.label = "z [mm]",
       .estimate = [](const F& f) { return MmFromM(f.est_X_HM.p.z()); },
       .truth = [](const F& f) { return MmFromM(f.true_X_HM.p.z()); },
       .desired = [](const F& f) { return MmFromM(f.desired.z_m); },
       .band = z_band_mm,
       .least_span = 3 * z_band_mm},
      {.label = "yaw [deg]",
       .estimate = [](const F& f) { return DegFromRad(YawOf(f.est_X_HM.q)); },
       .truth = [](const F& f) { return DegFromRad(YawOf(f.true_X_HM.q)); },
       .desired = [](const F& f) { return DegFromRad(f.desired.yaw_rad); },
       .least_span = 10},
  };
}

// The size of letters at which the outcome, a sentence of any length, ends with the figure.
double OutcomeSize(const std::string& outcome) {
  constexpr double kUsual = 13, kWidest = 0.0074;  // a letter's width at that size, roughly
  const double width = kWidest * static_cast<double>(outcome.size());
  return kUsual * std::min(1.0, (0.995 - kLeft) / width);
}

}  // namespace

void WriteTrialFigure(const std::string& path, const trial::TrialLog& log, const FigureInfo& info) {
  TD_CHECK(!log.frames.empty(), "a figure needs a frame");
  // a trial of one frame has a time axis, too
  const double end_s = std::max(log.frames.back().time_s, 1.0);
  const std::vector<StageSpan> spans = StageSpans(log);
  const std::vector<Panel> panels = Panels(info.criteria);

  media::GnuplotScript script;
  script.Line("set encoding utf8").Line("unset key");
  script.Line("set xrange [0:" + Number(end_s) + "]");
  script.Line("set lmargin at screen " + Number(kLeft));
  script.Line("set rmargin at screen " + Number(kRight));
  script.Line("set grid linetype 1 linewidth 0.6 linecolor rgb '#d4d9de'");
  script.Line("set border 15 linewidth 1 linecolor rgb '#6b747c'");
  script.Line("set tics nomirror scale 0.6 textcolor rgb '#20262b'");
  for (int i = 0; i < kPanels; ++i)
    WriteData(log, panels[static_cast<size_t>(i)], i, info.criteria.detection_fitness, &script);

  script.Line("set multiplot");
  script.Line("set label " + media::GnuplotQuoted(info.title) + " at screen " + Number(kLeft) +
              "," + Number(kTitleRow) + " left font 'Sans Bold,17'");
  script.Line("set label " + media::GnuplotQuoted(info.outcome) + " at screen " + Number(kLeft) +
              "," + Number(kOutcomeRow) + " left font 'Sans," + Number(OutcomeSize(info.outcome)) +
              "'");
  DrawLegend(info.criteria, &script);
  DrawStageBar(spans, end_s, &script);
  for (int i = 0; i < kPanels; ++i)
    DrawPanel(panels[static_cast<size_t>(i)], i, log, spans, info, &script);
  script.Line("unset multiplot");
  script.WritePng(path, kFigureWidth, kFigureHeight);
}

void WriteFigure(const std::string& folder, const trial::Scenario& scenario,
                 const trial::TrialResult& result) {
  WriteTrialFigure(folder + "/figure.png", result.log,
                   {.title = fmt::format("{}, seed {}", scenario.description, scenario.seed),
                    .outcome = fmt::format("{}: {}", NameOf(result.outcome), result.reason),
                    .criteria = trial::CriteriaOf(scenario)});
}

}  // namespace turbidock::run
