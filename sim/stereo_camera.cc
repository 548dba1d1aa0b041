#include "sim/stereo_camera.h"

#include <algorithm>
#include <utility>

namespace turbidock::sim {

StereoCamera::StereoCamera(Water water, ImageSensor sensor)
    : water_(std::move(water)), sensor_(sensor) {}

void StereoCamera::Expose(const RenderedStereo& rendered, int64_t frame, StereoImage* out,
                          StageTimer* timer) {
  water_.Prepare(rendered, water_.whole());
  Lap(timer, LoopStage::kWater);
  out->frame = frame;
  ExposeView(0, frame, rendered.left.surface, timer, &out->left);
  ExposeView(1, frame, rendered.right.surface, timer, &out->right);
}

void StereoCamera::ExposeView(int view, int64_t frame, const Image1u16& seen, StageTimer* timer,
                              Image3u8* out) {
  const int width = seen.width(), height = seen.height();
  out->Resize(width, height);
  band_.resize(static_cast<size_t>(TiledLight::kBandRows) * width * 3);
  for (int v = 0; v < height; v += TiledLight::kBandRows) {
    const int end = std::min(v + TiledLight::kBandRows, height);
    water_.PaintRows(view, v, end, band_.data());
    Lap(timer, LoopStage::kWater);
    sensor_.ExposeRows(view, frame, v, end, width, band_.data(), out->row(v));
    Lap(timer, LoopStage::kSensor);
  }
}

}  // namespace turbidock::sim
