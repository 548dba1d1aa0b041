#include "sim/stereo_camera.h"

#include <algorithm>
#include <utility>

namespace turbidock::sim {

StereoCamera::StereoCamera(Water water, ImageSensor sensor)
    : water_(std::move(water)), sensor_(sensor) {}

void StereoCamera::Expose(const RenderedStereo& rendered, const StereoRegion& region, int64_t frame,
                          StereoImage* out, StageTimer* timer) {
  water_.Prepare(rendered, region);
  Lap(timer, LoopStage::kWater);
  out->frame = frame;
  ExposeView(0, region.left, frame, rendered.left.surface, timer, &out->left);
  ExposeView(1, region.right, frame, rendered.right.surface, timer, &out->right);
}

void StereoCamera::ExposeView(int view, const PixelRegion& region, int64_t frame,
                              const Image1u16& seen, StageTimer* timer, Image3u8* out) {
  const int width = seen.width(), height = seen.height();
  out->Resize(width, height);
  if (region.empty()) return;
  band_.resize(static_cast<size_t>(TiledLight::kBandRows) * width * 3);
  int v = region.row_begin / TiledLight::kBandRows * TiledLight::kBandRows;
  for (; v < region.row_end; v += TiledLight::kBandRows) {
    const int band_end = std::min(v + TiledLight::kBandRows, height);
    water_.PaintRows(view, v, band_end, band_.data());
    Lap(timer, LoopStage::kWater);
    const int begin = std::max(v, region.row_begin), end = std::min(band_end, region.row_end);
    sensor_.ExposeRegion(view, frame, {region.column_begin, begin, region.column_end, end},
                         band_.data() + static_cast<ptrdiff_t>(begin - v) * width * 3, out);
    Lap(timer, LoopStage::kSensor);
  }
}

}  // namespace turbidock::sim
