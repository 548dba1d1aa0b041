#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <span>
#include <utility>

#include "experiments/media/canvas.h"
#include "experiments/media/png.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/trial/world.h"
#include "vision/overlay.h"

namespace turbidock::recognition {
namespace {

constexpr int kImageWidth = 240, kImageHeight = 180, kGap = 8, kHead = 26, kSide = 90;
constexpr int kCellWidth = 2 * kImageWidth + 2 * kGap, kCellHeight = kImageHeight + kHead;
constexpr Rgb kText{220, 226, 232};

StereoImage LastImageOf(const trial::Scenario& scenario, const CellResult& result) {
  const trial::FixedView view =
      trial::DrawFixedViews(scenario, {trial::StartPose(scenario).Inverse()}).front();
  StereoImage image;
  CamerasOf(view, trial::WaterOf(view, scenario), scenario, result.cell)
      .ExposeHeld(std::ssize(result.fitness) - 1, &image);
  return image;
}

// Stretches the brightness of all images alike, so that they can be compared: from what few of all
// their values are below to what few are above.
void Stretch(std::vector<StereoImage>* images) {
  std::vector<uint8_t> values;
  for (const StereoImage& image : *images)
    for (const Side side : kSides)
      values.insert(values.end(), image[side].data(),
                    image[side].data() + 3 * image[side].pixels());
  const auto quantile = [&](double share) {
    const auto at = values.begin() + static_cast<int64_t>(share * (std::ssize(values) - 1));
    std::nth_element(values.begin(), at, values.end());
    return static_cast<int>(*at);
  };
  const int dark = quantile(0.01), bright = std::max(quantile(0.9995), dark + 1);
  for (StereoImage& image : *images)
    for (const Side side : kSides)
      for (uint8_t& dn : std::span(image[side].data(), 3 * image[side].pixels()))
        dn = static_cast<uint8_t>(std::clamp(255 * (dn - dark) / (bright - dark), 0, 255));
}

// Both images of a cell with their left upper corner there, and the cell's numbers below.
void DrawCell(const trial::Scenario& scenario, const CellResult& r, const StereoImage& seen, int x,
              int y, media::Canvas* sheet) {
  const StereoRig rig = scenario.rig.MakeRig();
  for (const Side side : kSides) {
    const int left = side == Side::kLeft ? x : x + kImageWidth + kGap / 2;
    const media::PixelRect into =
        sheet->DrawImage(seen[side], {left, y, kImageWidth, kImageHeight});
    const double scale = static_cast<double>(into.width) / seen[side].width();
    sheet->Clip(into);
    for (const vision::ProjectedBall& ball :
         vision::ProjectBalls(scenario.marker, rig[side], r.last_X_HM))
      sheet->DottedCircle(scale * ball.center_px + Eigen::Vector2d(into.x, into.y),
                          scale * ball.radius_px * scenario.marker.outer_ring_ratio, 24, 1.5,
                          ball.rgb);
    sheet->Unclip();
  }
  sheet->Text(
      {x + kImageWidth + kGap / 4.0, y + kImageHeight + 17.0},
      fmt::format("F {:.2f} ± {:.2f}, Area {}", r.fitness_mean, r.fitness_std, NameOf(r.area)), 14,
      kText, media::Align::kCenter);
}

}  // namespace

void WriteImageSheet(const std::string& path, const batch::Plan& plan, MarkerKind marker,
                     const std::vector<CellResult>& results) {
  constexpr int kMostColumns = 5;
  const Columns columns = ColumnsOf(results, {}).at(marker);
  std::map<double, int> left;  // of columns by milk
  for (const Column& column : columns)
    for (const auto& [milk, cell] : column.cells) left[milk] = 0;
  const auto stride = 1 + (static_cast<int>(left.size()) - 1) / kMostColumns;
  std::erase_if(left, [&, i = 0](const auto&) mutable { return i++ % stride != 0; });
  int width = kSide, height = kHead;
  for (auto& [milk, x] : left) x = std::exchange(width, width + kCellWidth);
  struct Shown {
    const CellResult* result;
    trial::Scenario scenario;
    int x, y;
  };
  std::vector<Shown> shown;
  std::vector<StereoImage> images;
  for (const Column& column : columns) {
    for (const auto& [milk, r] : column.cells) {
      if (!left.contains(milk)) continue;
      shown.push_back({&r, plan.ScenarioOf(plan.Trial(r.trial)), left.at(milk), height});
      images.push_back(LastImageOf(shown.back().scenario, r));
    }
    height += kCellHeight;
  }
  Stretch(&images);

  media::Canvas sheet(width, height);
  sheet.Text({8, 18}, "same contrast", 12, kText);
  for (const auto& [milk, x] : left)
    sheet.Text({x + kCellWidth / 2.0, 18}, fmt::format("{:g} ml/m³", milk), 16, kText,
               media::Align::kCenter, true);
  for (size_t i = 0; i < columns.size(); ++i)
    sheet.Text({8, kHead + static_cast<double>(i) * kCellHeight + kImageHeight / 2.0},
               columns[i].name, 16, kText);
  for (size_t i = 0; i < shown.size(); ++i)
    DrawCell(shown[i].scenario, *shown[i].result, images[i], shown[i].x, shown[i].y, &sheet);
  media::WritePng(path, sheet.ToImage());
}

}  // namespace turbidock::recognition
