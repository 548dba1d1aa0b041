#include "experiments/studies/recognition/image_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "experiments/media/canvas.h"
#include "experiments/media/png.h"
#include "sim/base/units.h"
#include "vision/overlay.h"

namespace turbidock::recognition {
namespace {

constexpr int kImageWidth = 240, kImageHeight = 180, kGap = 8, kHead = 26, kSide = 90;
constexpr int kCellWidth = 2 * kImageWidth + 2 * kGap, kCellHeight = kImageHeight + kHead;
constexpr Rgb kText{220, 226, 232};

// From dark to bright over the whole scale, both images alike: at night they show little otherwise.
void StretchContrast(StereoImage* images) {
  std::array<int, 256> histogram{};
  int values = 0;
  for (const Side side : kSides) {
    const Image3u8& image = (*images)[side];
    const int count = 3 * image.width() * image.height();
    for (int i = 0; i < count; ++i) ++histogram[image.data()[i]];
    values += count;
  }
  const auto quantile = [&](double share) {
    int dn = 0;
    for (int below = histogram[0]; dn < 255 && below < share * values;)
      below += histogram[static_cast<size_t>(++dn)];
    return dn;
  };
  const int dark = quantile(0.01), bright = std::max(quantile(0.9995), dark + 1);
  for (const Side side : kSides) {
    Image3u8& image = (*images)[side];
    for (int i = 0; i < 3 * image.width() * image.height(); ++i) {
      uint8_t& dn = image.data()[i];
      dn = static_cast<uint8_t>(std::clamp(255 * (dn - dark) / (bright - dark), 0, 255));
    }
  }
}

// All steps of milk that occur, or so many of them evenly.
std::vector<double> MilkSteps(const std::vector<CellResult>& results, int most) {
  std::set<double> steps;
  for (const CellResult& r : results) steps.insert(r.cell.milk_ml_m3);
  const std::vector<double> milk(steps.begin(), steps.end());
  if (std::ssize(milk) <= most) return milk;
  std::vector<double> some;
  for (int i = 0; i < most; ++i)
    some.push_back(milk[static_cast<size_t>(i) * (milk.size() - 1) /
                        static_cast<size_t>(std::max(1, most - 1))]);
  return some;
}

// Both images of a cell with their left upper corner there, and the cell's numbers below.
void DrawCell(const Recognition& recognition, const CellResult& r, int x, int y,
              media::Canvas* sheet) {
  const trial::Scenario& scenario = recognition.scenario(r.cell.marker);
  StereoImage seen = recognition.Image(r.cell, std::ssize(r.fitness) - 1);
  StretchContrast(&seen);
  for (const Side side : kSides) {
    const int left = side == Side::kLeft ? x : x + kImageWidth + kGap / 2;
    const media::PixelRect into =
        sheet->DrawImage(seen[side], {left, y, kImageWidth, kImageHeight});
    sheet->Clip(into);
    const double scale = static_cast<double>(into.width) / seen[side].width();
    for (const vision::ProjectedBall& ball :
         vision::ProjectBalls(scenario.marker, recognition.view(r.cell).rig[side], r.last_X_HM)) {
      const Eigen::Vector2d center(into.x + scale * (ball.center_px.x() + 0.5) - 0.5,
                                   into.y + scale * (ball.center_px.y() + 0.5) - 0.5);
      sheet->DottedCircle(center, scale * ball.radius_px, 16, 2, {255, 255, 255});
      sheet->DottedCircle(center, scale * ball.radius_px * scenario.marker.outer_ring_ratio, 24,
                          1.5, ball.rgb);
    }
    sheet->Unclip();
  }
  sheet->Text(
      {x + kImageWidth + kGap / 4.0, y + kImageHeight + 17.0},
      fmt::format("F {:.2f} ± {:.2f}, Area {}", r.fitness_mean, r.fitness_std, NameOf(r.area)), 14,
      kText, media::Align::kCenter);
}

}  // namespace

void WriteImageSheet(const std::string& path, const Recognition& recognition,
                     const std::vector<CellResult>& results, int columns) {
  const std::vector<double> milk = MilkSteps(results, columns);
  std::map<double, std::map<double, const CellResult*>> rows;  // by distance and milk
  for (const CellResult& r : results) rows[r.cell.distance_m][r.cell.milk_ml_m3] = &r;
  media::Canvas sheet(kSide + kCellWidth * static_cast<int>(milk.size()),
                      kHead + kCellHeight * static_cast<int>(rows.size()));
  sheet.Text({8, 18}, "stretched", 12, kText);
  const auto left_of = [](size_t column) { return kSide + kCellWidth * static_cast<int>(column); };
  for (size_t i = 0; i < milk.size(); ++i)
    sheet.Text({left_of(i) + kCellWidth / 2.0, 18}, fmt::format("{:g} ml/m³", milk[i]), 16, kText,
               media::Align::kCenter, true);
  int y = kHead;
  for (const auto& [distance_m, row] : rows) {
    sheet.Text({8, y + kImageHeight / 2.0}, fmt::format("{:g} mm", units::MmFromM(distance_m)), 16,
               kText);
    for (size_t i = 0; i < milk.size(); ++i)
      if (const auto found = row.find(milk[i]); found != row.end())
        DrawCell(recognition, *found->second, left_of(i), y, &sheet);
    y += kCellHeight;
  }
  media::WritePng(path, sheet.ToImage());
}

}  // namespace turbidock::recognition
