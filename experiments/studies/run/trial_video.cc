#include "experiments/studies/run/trial_video.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <sstream>
#include <utility>

#include "experiments/media/draw_balls.h"
#include "experiments/report/table.h"
#include "experiments/trial/trace_panels.h"
#include "experiments/trial/trial_report.h"

namespace turbidock::run {
namespace {

constexpr media::PixelRect kLeftPanel{0, 0, 640, 480}, kRightPanel{640, 0, 640, 480};
constexpr media::PixelRect kSpectatorPanel{0, 480, 320, 240};
constexpr int kChartsTop = 480;
constexpr int kLegendHeight = 22;
constexpr int kChartWidth = (kVideoWidth - kSpectatorPanel.width) / 2;
constexpr int kChartHeight = (kVideoHeight - kChartsTop - kLegendHeight) / 2;

constexpr Rgb kGround{15, 20, 26};
constexpr Rgb kText{232, 237, 242};
constexpr Rgb kFaintText{176, 186, 196};
constexpr double kTextSize = 14, kSmallSize = 12;
constexpr double kTitleWidth_px = 500;  // clear of the time at the right

// The panels beside the spectator's view, column by column.
constexpr trial::Trace kCharts[] = {trial::Trace::kFitness, trial::Trace::kX, trial::Trace::kY,
                                    trial::Trace::kZ};

// Text on a dark, half transparent plate: readable on any image. Returns the column behind the
// plate.
int DrawPlate(media::Canvas* canvas, int x, int y, const std::string& text, Rgb color,
              media::Align align = media::Align::kLeft, bool bold = false) {
  constexpr int kHeight = 24, kPadding = 9;
  const int width =
      static_cast<int>(std::ceil(canvas->TextWidth(text, kTextSize, bold))) + 2 * kPadding;
  const int left = align == media::Align::kRight ? x - width : x;
  canvas->FillRect({left, y, width, kHeight}, kGround, 0.8);
  canvas->Text({static_cast<double>(left + kPadding), y + 17.0}, text, kTextSize, color,
               media::Align::kLeft, bold);
  return left + width;
}

// The text in lines no wider than that.
std::vector<std::string> Wrapped(const std::string& text, double width_px, double size_px,
                                 media::Canvas* canvas) {
  std::vector<std::string> lines(1);
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
    if (canvas->TextWidth(longer, size_px) > width_px)
      lines.push_back(word);
    else
      lines.back() = std::move(longer);
  }
  return lines;
}

}  // namespace

VideoComposer::VideoComposer(const trial::Scenario& scenario)
    : criteria_(trial::CriteriaOf(scenario)),
      title_(trial::TitleOf(scenario)),
      envelope_ratio_(scenario.marker.outer_ring_ratio),
      canvas_(kVideoWidth, kVideoHeight) {
  const double duration_s = scenario.duration_s + scenario.after_docked_s;
  for (size_t i = 0; i < std::size(kCharts); ++i)
    charts_.emplace_back(duration_s, kChartWidth, kChartHeight);
}

const media::Canvas& VideoComposer::Compose(const VideoFrame& frame) {
  const trial::FrameRecord& record = frame.record;
  canvas_.FillRect(canvas_.area(), kGround);
  const bool trusted = record.fitness >= criteria_.detection_fitness;
  for (const Side side : kSides)
    media::DrawBalls(frame.images[side], frame.balls[side], trusted, envelope_ratio_,
                     side == Side::kLeft ? kLeftPanel : kRightPanel, &canvas_);
  // a seam between the two images, which may both be black
  canvas_.FillRect({kRightPanel.x - 1, 0, 2, kRightPanel.height}, kGround);
  canvas_.FillRect({0, kChartsTop - 1, kVideoWidth, 2}, kGround);
  DrawPlate(&canvas_, 10, kLeftPanel.bottom() - 34, "left camera", kFaintText);
  DrawPlate(&canvas_, kRightPanel.x + 10, kRightPanel.bottom() - 34, "right camera", kFaintText);
  DrawStatus(record);
  if (frame.spectator) canvas_.DrawImage(*frame.spectator, kSpectatorPanel);
  DrawPlate(&canvas_, 10, kSpectatorPanel.bottom() - 34, "from outside", kFaintText);
  if (series_.columns().empty())
    series_ = trial::Series(std::vector<std::string>(record.command.volts.size()));
  series_.Add(record);
  DrawCharts();
  DrawLegend();
  return canvas_;
}

const media::Canvas& VideoComposer::Conclude(const std::string& outcome,
                                             const std::string& reason) {
  constexpr double kOutcomeSize = 34, kReasonSize = 17, kLineHeight = 26;
  constexpr int kTop = 180, kHead = 58;
  const double middle = kVideoWidth / 2.0;
  const std::vector<std::string> lines = Wrapped(reason, kVideoWidth - 160, kReasonSize, &canvas_);
  const int height = kHead + static_cast<int>(kLineHeight * static_cast<double>(lines.size())) + 14;
  canvas_.FillRect({0, kTop, kVideoWidth, height}, kGround, 0.88);
  canvas_.Text({middle, kTop + 42.0}, outcome, kOutcomeSize, kText, media::Align::kCenter,
               /*bold=*/true);
  for (size_t i = 0; i < lines.size(); ++i)
    canvas_.Text({middle, kTop + kHead + 16 + kLineHeight * static_cast<double>(i)}, lines[i],
                 kReasonSize, kText, media::Align::kCenter);
  return canvas_;
}

void VideoComposer::DrawStatus(const trial::FrameRecord& record) {
  const int x = DrawPlate(&canvas_, 10, 10, report::Words(NameOf(record.stage)),
                          trial::kOnDark.Of(record.stage), media::Align::kLeft, /*bold=*/true);
  DrawPlate(
      &canvas_, x + 8, 10,
      fmt::format("F = {:.2f}   {}", record.fitness, trial::AreaTitle(record.fitness, criteria_)),
      kText);
  DrawPlate(&canvas_, kRightPanel.x + 10, 10,
            Wrapped(title_, kTitleWidth_px, kTextSize, &canvas_)[0], kText);
  DrawPlate(&canvas_, kVideoWidth - 10, 10, fmt::format("{:.1f} s", record.time_s), kText,
            media::Align::kRight);
}

void VideoComposer::DrawCharts() {
  const size_t rows = series_.rows();
  const auto panels = [&](size_t first_row) {
    return trial::TracePanels(series_, criteria_, {first_row, trial::kOnDark});
  };
  const std::vector<report::Panel> news = panels(rows < 2 ? 0 : rows - 2);
  for (size_t i = 0; i < charts_.size(); ++i) {
    media::PanelChart& chart = charts_[i];
    const auto trace = static_cast<size_t>(kCharts[i]);
    if (!chart.Add(news[trace])) chart.Draw(panels(0)[trace]);
    const int x = kSpectatorPanel.width + static_cast<int>(i / 2) * kChartWidth;
    const int y = kChartsTop + kLegendHeight + static_cast<int>(i % 2) * kChartHeight;
    chart.DrawTo(&canvas_, x, y);
    // the values of now, in columns above the chart's right end
    double right = x + chart.plot().right();
    for (const report::Series& series : news[trace].series) {
      if (series.mark != report::Mark::kLine) continue;
      const double value = series.points.back().y;
      const int digits = kCharts[i] == trial::Trace::kFitness ? 2 : 0;
      const std::string text = std::isfinite(value) ? report::Fixed(value, digits) : "lost";
      canvas_.Text({right, y + 14.0}, text, kSmallSize, series.color, media::Align::kRight);
      right -= 44;
    }
  }
}

// Right to left.
void VideoComposer::DrawLegend() {
  double x = kVideoWidth - 18;
  const double y = kChartsTop + 16;
  const std::string band = "allowed";
  const std::pair<std::string, Rgb> entries[] = {{band, trial::kOnDark.limit},
                                                 {"desired", trial::kOnDark.desired},
                                                 {"truth", trial::kOnDark.truth},
                                                 {"estimate", trial::kOnDark.estimate}};
  for (const auto& [name, color] : entries) {
    canvas_.Text({x, y}, name, kSmallSize, kText, media::Align::kRight);
    x -= canvas_.TextWidth(name, kSmallSize) + 6;
    // a broad, faint mark stands for the band
    const bool area = name == band;
    canvas_.Line({x - 18, y - 4}, {x, y - 4}, area ? 9 : 3, color, area ? 0.3 : 1);
    x -= 18 + 16;
  }
}

}  // namespace turbidock::run
