#include "sim/camera/stereo_camera.h"

#include <algorithm>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::camera {
namespace {

// Automatic exposure follows in half a second: it need not meter more often, and both views are
// drawn whole for it.
constexpr int kFramesPerMetering = 15;

}  // namespace

StereoCamera::StereoCamera(light::Water water, ImageSensor sensor, const AutoExposure& exposure,
                           light::MarineSnow snow, StereoLens lens)
    : water_(std::move(water)),
      sensor_(std::move(sensor)),
      exposure_(exposure),
      snow_(std::move(snow)),
      lens_(std::move(lens)) {}

StereoCamera::StereoCamera(const CameraParams& params, const StereoRig& rig,
                           const light::SurfaceTable& surfaces, const std::vector<Pose>& X_HE,
                           double frame_s, const SeedTree& seeds)
    : StereoCamera(params, light::Water(params.optics, rig, surfaces, X_HE), frame_s, seeds) {}

StereoCamera::StereoCamera(const CameraParams& params, light::Water water, double frame_s,
                           const SeedTree& seeds)
    : water_(std::move(water)),
      sensor_(params.sensor, seeds.Stream("camera.left").NextU64(),
              seeds.Stream("camera.right").NextU64(), water_.rig().left.width_px),
      exposure_(params.sensor, kFramesPerMetering * frame_s),
      snow_(params.snow, frame_s, seeds.Stream("snow").NextU64()),
      lens_(params.lens, water_.rig()) {}

StereoRegion StereoCamera::Seen(const StereoRegion& region, int64_t frame) const {
  return Meters(frame) || PaintsWhole() ? whole() : water_.Seen(Lit(region));
}

// The region and what the sensor needs beside it.
StereoRegion StereoCamera::Lit(const StereoRegion& region) const {
  StereoRegion lit = region;
  for (const Side side : kSides) {
    if (region[side].empty()) continue;
    PixelRegion& part = lit[side];
    part.column_begin = std::max(part.column_begin - sensor_.margin_px(), 0);
    part.column_end = std::min(part.column_end + sensor_.margin_px(), whole()[side].column_end);
  }
  return lit;
}

void StereoCamera::Expose(const view::RenderedStereo& rendered, const StereoRegion& region,
                          int64_t frame, StereoImage* out, StageTimer* timer) {
  const bool whole_images = PaintsWhole();
  if (whole_images)
    water_.Apply(rendered, &radiance_);
  else
    water_.Prepare(rendered, Lit(region));
  if (Meters(frame)) {
    sensor_.Amplify(exposure_.For(water_.MeteredRadiance(rendered)));
    meters_next_ = frame - frame % kFramesPerMetering + kFramesPerMetering;
  }
  snow_.Fall(rendered, whole_images ? whole() : Lit(region), frame, &water_);
  if (whole_images) {
    snow_.Paint(&radiance_);
    lens_.Distort(&radiance_);
    port_.Spoil(&radiance_);
    Lap(timer, LoopStage::kWater);
    sensor_.Digitise(radiance_, region, frame, out);
    Lap(timer, LoopStage::kSensor);
    return;
  }
  Lap(timer, LoopStage::kWater);
  out->frame = frame;
  for (const Side side : kSides) ExposeSide(side, region[side], frame, timer, &(*out)[side]);
}

void StereoCamera::Hold(const view::RenderedStereo& rendered) {
  held_view_ = &rendered;
  water_.Apply(rendered, &held_);
  if (!snow_.on()) lens_.Distort(&held_);
  if (exposure_.on()) sensor_.Amplify(exposure_.For(water_.MeteredRadiance(rendered)));
}

void StereoCamera::ExposeHeld(const StereoRegion& region, int64_t frame, StereoImage* out) {
  TD_CHECK(held_view_, "a view to expose");
  if (!snow_.on()) {
    sensor_.Digitise(held_, region, frame, out);
    return;
  }
  radiance_ = held_;
  snow_.Fall(*held_view_, lens_.on() ? whole() : Lit(region), frame, &water_);
  snow_.Paint(&radiance_);
  lens_.Distort(&radiance_);
  sensor_.Digitise(radiance_, region, frame, out);
}

void StereoCamera::ExposeSide(Side side, const PixelRegion& region, int64_t frame,
                              StageTimer* timer, Image3u8* out) {
  const int width = whole()[side].width(), height = whole()[side].height();
  out->Resize(width, height);
  if (region.empty()) return;
  band_.resize(static_cast<size_t>(light::TiledLight::kBandRows) * width * 3);
  int v = region.row_begin / light::TiledLight::kBandRows * light::TiledLight::kBandRows;
  for (; v < region.row_end; v += light::TiledLight::kBandRows) {
    const int band_end = std::min(v + light::TiledLight::kBandRows, height);
    water_.PaintRows(side, v, band_end, band_.data());
    snow_.PaintRows(side, v, band_end, band_.data());
    Lap(timer, LoopStage::kWater);
    const int begin = std::max(v, region.row_begin), end = std::min(band_end, region.row_end);
    sensor_.DigitiseRegion(side, frame, {region.column_begin, begin, region.column_end, end},
                           band_.data() + static_cast<ptrdiff_t>(begin - v) * width * 3, out);
    Lap(timer, LoopStage::kSensor);
  }
}

}  // namespace turbidock::camera
