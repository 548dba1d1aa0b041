#pragma once
// Images of a pinhole camera from those of a real lens.

#include <array>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/image.h"

namespace turbidock::vision {

// A lens as OpenCV numbers its coefficients. A point (x, y) at depth 1 is seen where the
// undistorted camera sees (x', y'). Brown's model, with thin prisms (s1 to s4):
//   x' = x g + 2 p1 x y + p2 (r2 + 2 x2) + s1 r2 + s2 r4,
//   y' = y g + p1 (r2 + 2 y2) + 2 p2 x y + s3 r2 + s4 r4,
//   g = (1 + k1 r2 + k2 r4 + k3 r6) / (1 + k4 r2 + k5 r4 + k6 r6).
// An equidistant lens (cv::fisheye, Kannala and Brandt): (x', y') = (x, y) / r times
//   t (1 + k1 t2 + k2 t4 + k3 t6 + k4 t8), t = atan r.
struct LensDistortion {
  bool equidistant = false;
  double k1 = 0, k2 = 0, k3 = 0, k4 = 0, k5 = 0, k6 = 0, p1 = 0, p2 = 0;
  double s1 = 0, s2 = 0, s3 = 0, s4 = 0;

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
