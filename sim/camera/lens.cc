#include "sim/camera/lens.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace turbidock::camera {
namespace {

double Seen(const LensParams& params, double r) {
  return r * (1 + r * r * (params.k1 + r * r * params.k2));
}

double Slope(const LensParams& params, double r) {
  return 1 + r * r * (3 * params.k1 + 5 * r * r * params.k2);
}

// Where seen radii lie this close together the image is nearly folded over.
constexpr double kMinSlope = 0.1;

// Of the corner farthest from the principal point.
double LargestRadius(const CameraIntrinsics& camera) {
  double most = 0;
  for (const double u : {0.0, camera.width_px - 1.0})
    for (const double v : {0.0, camera.height_px - 1.0})
      most = std::max(most, camera.RayAt(u, v).head<2>().norm());
  return most;
}

}  // namespace

StereoLens::StereoLens(const LensParams& params, const StereoRig& rig) {
  CheckFields(params, "cameras.lens");
  if (params.k1 == 0 && params.k2 == 0) return;
  for (const Side side : kSides) {
    const double corner = LargestRadius(rig[side]);
    // what is seen in the corner may lie far outside a pinhole's picture
    for (double r = 0; Seen(params, r) < corner; r += 0.01 * corner)
      if (Slope(params, r) <= kMinSlope)
        throw ConfigError("cameras.lens.k1",
                          FormatNumber(params.k1) + " with k2 = " + FormatNumber(params.k2) +
                              " must not fold the image over inside its corners");
    sources_[side] = Sources(params, rig[side]);
  }
}

double StereoLens::PinholeRadius(const LensParams& params, double seen_radius) {
  double r = seen_radius;
  for (int i = 0; i < 20; ++i) {  // Newton's
    const double step = (Seen(params, r) - seen_radius) / std::max(kMinSlope, Slope(params, r));
    r -= step;
    if (std::abs(step) < 1e-14) break;
  }
  return r;
}

std::vector<StereoLens::Source> StereoLens::Sources(const LensParams& params,
                                                    const CameraIntrinsics& camera) {
  std::vector<Source> sources;
  sources.reserve(static_cast<size_t>(camera.width_px) * camera.height_px);
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector2d seen = camera.RayAt(u, v).head<2>();
      const double r = seen.norm();
      const double scale = r > 0 ? PinholeRadius(params, r) / r : 1;
      const Eigen::Vector2d at =
          camera.Project({scale * seen.x(), scale * seen.y(), 1})
              .cwiseMax(0)
              .cwiseMin(Eigen::Vector2d(camera.width_px - 1, camera.height_px - 1));
      const int column = std::min(static_cast<int>(at.x()), camera.width_px - 2);
      const int row = std::min(static_cast<int>(at.y()), camera.height_px - 2);
      sources.push_back({row * camera.width_px + column, static_cast<float>(at.x() - column),
                         static_cast<float>(at.y() - row)});
    }
  return sources;
}

void StereoLens::Distort(light::RadianceStereo* images) {
  if (!on()) return;
  for (const Side side : kSides) {
    Image3f& image = (*images)[side];
    seen_.Resize(image.width(), image.height());
    const int next_row = 3 * image.width();
    float* out = seen_.data();
    for (const Source& source : sources_[side]) {
      const float* p = image.data() + 3 * source.index;
      for (int k = 0; k < 3; ++k, ++p) {
        const float above = p[0] + source.u * (p[3] - p[0]);
        const float below = p[next_row] + source.u * (p[next_row + 3] - p[next_row]);
        *out++ = above + source.v * (below - above);
      }
    }
    std::swap(image, seen_);
  }
}

}  // namespace turbidock::camera
