#include "vision/undistort.h"

#include <cmath>

namespace turbidock::vision {

Eigen::Vector2d LensDistortion::Apply(const Eigen::Vector2d& point) const {
  const double x = point.x(), y = point.y(), r2 = x * x + y * y;
  if (equidistant) {
    const double r = std::sqrt(r2), t = std::atan(r), t2 = t * t;
    return r < 1e-9 ? point : point * (t / r * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))));
  }
  const double gain = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)));
  return {x * gain + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + r2 * s2),
          y * gain + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + r2 * s4)};
}

Undistorter::Undistorter(const CameraIntrinsics& camera, const LensDistortion& distortion)
    : width_(camera.width_px), height_(camera.height_px) {
  sources_.reserve(static_cast<size_t>(width_) * static_cast<size_t>(height_));
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      const Eigen::Vector2d seen = distortion.Apply(camera.RayAt(u, v).head<2>());
      const double at_u = camera.fx_px * seen.x() + camera.cx_px;
      const double at_v = camera.fy_px * seen.y() + camera.cy_px;
      if (!(at_u >= 0 && at_v >= 0 && at_u < width_ - 1 && at_v < height_ - 1)) {
        sources_.push_back({-1, 0, 0});
        continue;
      }
      const int column = static_cast<int>(at_u), row = static_cast<int>(at_v);
      sources_.push_back({row * width_ + column, static_cast<uint8_t>(256 * (at_u - column)),
                          static_cast<uint8_t>(256 * (at_v - row))});
    }
}

void Undistorter::Apply(Image3u8* image) {
  TD_CHECK(image->width() == width_ && image->height() == height_, "an image of the camera's size");
  std::swap(*image, seen_);
  image->Resize(width_, height_);
  const size_t next_row = 3 * static_cast<size_t>(width_);
  for (size_t i = 0; i < sources_.size(); ++i) {
    const Source& source = sources_[i];
    uint8_t* out = image->data() + 3 * i;
    if (source.offset < 0) {
      out[0] = out[1] = out[2] = 0;
      continue;
    }
    const uint8_t* in = seen_.data() + 3 * static_cast<size_t>(source.offset);
    const int u = source.u_share, v = source.v_share;
    for (size_t k = 0; k < 3; ++k) {
      const int above = (256 - u) * in[k] + u * in[k + 3];
      const int below = (256 - u) * in[k + next_row] + u * in[k + next_row + 3];
      out[k] = static_cast<uint8_t>(((256 - v) * above + v * below + (1 << 15)) >> 16);
    }
  }
}

}  // namespace turbidock::vision
