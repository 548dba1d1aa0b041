#pragma once
// Images of a pinhole camera from those of a real lens.

#include <array>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/image.h"

namespace turbidock::vision {

// Brown's lens model as OpenCV numbers its coefficients: k1, k2, p1, p2, k3 and the denominators
// k4, k5, k6. A point (x, y) at depth 1 is seen where the undistorted camera sees (x', y'):
//   x' = x g + 2 p1 x y + p2 (r2 + 2 x2),  y' = y g + p1 (r2 + 2 y2) + 2 p2 x y,
//   g = (1 + k1 r2 + k2 r4 + k3 r6) / (1 + k4 r2 + k5 r4 + k6 r6).
struct LensDistortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0, k4 = 0, k5 = 0, k6 = 0;

  Eigen::Vector2d Apply(const Eigen::Vector2d& point) const;
  bool is_none() const { return *this == LensDistortion{}; }
  bool operator==(const LensDistortion&) const = default;
};

class Undistorter {
 public:
  // The undistorted camera has the same intrinsics as the real one.
  Undistorter(const CameraIntrinsics& camera, const LensDistortion& distortion);

  // Bilinear; black where the lens did not look. The image must have the camera's size.
  void Apply(Image3u8* image);

 private:
  struct Source {
    int32_t offset;            // of the pixel to the upper left, or negative: not seen
    uint8_t u_share, v_share;  // of the next column and row, in 1/256
  };
  int width_, height_;
  std::vector<Source> sources_;
  Image3u8 seen_;  // the image as it was
};

}  // namespace turbidock::vision
