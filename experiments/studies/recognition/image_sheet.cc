#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

#include "experiments/media/canvas.h"
#include "experiments/media/png.h"
#include "experiments/studies/recognition/report.h"
#include "sim/base/units.h"
#include "vision/overlay.h"

namespace turbidock::recognition {
namespace {

constexpr int kImageWidth = 240, kImageHeight = 180, kGap = 8, kHead = 26, kSide = 90;
constexpr int kCellWidth = 2 * kImageWidth + 2 * kGap, kCellHeight = kImageHeight + kHead;
constexpr Rgb kText{220, 226, 232};

// The brightness from which and to which all images of a sheet are stretched alike, so that they
// can be compared: what few of all their values are below and above.
std::pair<int, int> ContrastOf(const std::vector<StereoImage>& images) {
  std::vector<uint8_t> values;
  for (const StereoImage& image : images)
    for (const Side side : kSides)
      values.insert(values.end(), image[side].data(),
                    image[side].data() + 3 * image[side].pixels());
  const auto quantile = [&](double share) {
    const auto at = values.begin() + static_cast<int64_t>(share * (std::ssize(values) - 1));
    std::nth_element(values.begin(), at, values.end());
    return static_cast<int>(*at);
  };
  const int dark = quantile(0.01);
  return {dark, std::max(quantile(0.9995), dark + 1)};
}

// Both images of a cell with their left upper corner there, and the cell's numbers below.
void DrawCell(const Recognition& recognition, const CellResult& r, StereoImage seen,
              const std::pair<int, int>& contrast, int x, int y, media::Canvas* sheet) {
  const auto [dark, bright] = contrast;
  const vision::MarkerParams& marker = recognition.scenario(r.cell.marker).marker;
  for (const Side side : kSides) {
    for (size_t i = 0; i < 3 * seen[side].pixels(); ++i) {
      uint8_t& dn = seen[side].data()[i];
      dn = static_cast<uint8_t>(std::clamp(255 * (dn - dark) / (bright - dark), 0, 255));
    }
    const int left = side == Side::kLeft ? x : x + kImageWidth + kGap / 2;
    const media::PixelRect into =
        sheet->DrawImage(seen[side], {left, y, kImageWidth, kImageHeight});
    const double scale = static_cast<double>(into.width) / seen[side].width();
    sheet->Clip(into);
    for (const vision::ProjectedBall& ball :
         vision::ProjectBalls(marker, recognition.view(r.cell).rig[side], r.last_X_HM))
      sheet->DottedCircle(scale * ball.center_px + Eigen::Vector2d(into.x, into.y),
                          scale * ball.radius_px * marker.outer_ring_ratio, 24, 1.5, ball.rgb);
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
  std::set<double> steps;
  for (const CellResult& r : results) steps.insert(r.cell.milk_ml_m3);
  const auto stride = 1 + (static_cast<int>(steps.size()) - 1) / columns;
  std::vector<double> milk;
  int index = 0;
  for (const double step : steps)
    if (index++ % stride == 0) milk.push_back(step);
  std::map<double, int> rows;  // of each distance
  std::vector<CellResult> shown;
  std::vector<StereoImage> images;
  for (const CellResult& r : results) {
    if (!std::ranges::binary_search(milk, r.cell.milk_ml_m3)) continue;
    rows[r.cell.distance_m] = 0;
    shown.push_back(r);
    images.push_back(recognition.Image(r.cell, std::ssize(r.fitness) - 1));
  }
  media::Canvas sheet(kSide + kCellWidth * static_cast<int>(milk.size()),
                      kHead + kCellHeight * static_cast<int>(rows.size()));
  const auto left_of = [](auto column) { return kSide + kCellWidth * static_cast<int>(column); };
  sheet.Text({8, 18}, "one contrast", 12, kText);
  for (size_t i = 0; i < milk.size(); ++i)
    sheet.Text({left_of(i) + kCellWidth / 2.0, 18}, fmt::format("{:g} ml/m³", milk[i]), 16, kText,
               media::Align::kCenter, true);
  int y = kHead;
  for (auto& [distance_m, top] : rows) {
    top = std::exchange(y, y + kCellHeight);
    sheet.Text({8, top + kImageHeight / 2.0}, fmt::format("{:g} mm", units::MmFromM(distance_m)),
               16, kText);
  }
  const std::pair<int, int> contrast = ContrastOf(images);
  for (size_t i = 0; i < shown.size(); ++i) {
    const auto column = std::ranges::find(milk, shown[i].cell.milk_ml_m3) - milk.begin();
    DrawCell(recognition, shown[i], std::move(images[i]), contrast, left_of(column),
             rows.at(shown[i].cell.distance_m), &sheet);
  }
  media::WritePng(path, sheet.ToImage());
}

}  // namespace turbidock::recognition
