#include "sim/camera/view_fault.h"

#include <algorithm>
#include <cmath>

namespace turbidock::camera {
namespace {

// 1 where the dirt lies, 0 beyond its edge.
double Cover(double distance, double radius) {
  const double x = std::clamp(2 - 2 * distance / radius, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

void Soil(const DirtFault& dirt, Image3f* image) {
  const double width = image->width();
  for (int v = 0; v < image->height(); ++v)
    for (int u = 0; u < image->width(); ++u) {
      const double across = (u + 0.5) / width - dirt.center.x();
      const double down = ((v + 0.5) / image->height() - dirt.center.y()) * image->height() / width;
      const double cover = Cover(std::hypot(across, down), dirt.radius);
      if (cover == 0) continue;
      const auto share = static_cast<float>(1 - cover * (1 - dirt.transmission));
      for (int k = 0; k < 3; ++k) image->at(u, v)[k] *= share;
    }
}

void Blur(double sigma_px, Image3f* image) {
  const int reach = static_cast<int>(std::ceil(3 * sigma_px));
  std::vector<float> weights(2 * static_cast<size_t>(reach) + 1);
  double sum = 0;
  const auto weight = [&](int i) { return std::exp(-i * i / (2 * sigma_px * sigma_px)); };
  for (int i = -reach; i <= reach; ++i) sum += weight(i);
  for (int i = -reach; i <= reach; ++i)
    weights[static_cast<size_t>(i + reach)] = static_cast<float>(weight(i) / sum);

  const int width = image->width(), height = image->height();
  const Image3f sharp = *image;
  std::vector<float> row(3 * static_cast<size_t>(width));
  for (int v = 0; v < height; ++v) {  // down, then across
    std::fill(row.begin(), row.end(), 0.0f);
    for (int i = -reach; i <= reach; ++i) {
      const float w = weights[static_cast<size_t>(i + reach)];
      const float* from = sharp.row(std::clamp(v + i, 0, height - 1));
      for (size_t k = 0; k < row.size(); ++k) row[k] += w * from[k];
    }
    float* out = image->row(v);
    std::fill_n(out, row.size(), 0.0f);
    for (int i = -reach; i <= reach; ++i) {
      const float w = weights[static_cast<size_t>(i + reach)];
      for (int u = 0; u < width; ++u) {
        const float* from = &row[3 * static_cast<size_t>(std::clamp(u + i, 0, width - 1))];
        for (int k = 0; k < 3; ++k) out[3 * u + k] += w * from[k];
      }
    }
  }
}

}  // namespace

StereoRig Misaligned(const StereoRig& rig, const std::vector<CameraMisalignment>& faults) {
  StereoRig misaligned = rig;
  for (const CameraMisalignment& fault : faults)
    for (const Side side : kSides)
      if (Has(fault.camera, side)) {
        const Eigen::Vector3d& a = fault.yaw_pitch_roll_rad;
        misaligned[side].X_HC.q = FromYawPitchRoll(a[0], a[1], a[2]) * misaligned[side].X_HC.q;
      }
  return misaligned;
}

void PortFaults::Spoil(light::RadianceStereo* images) const {
  for (const Side side : kSides) {
    for (const DirtFault& patch : dirt)
      if (Has(patch.camera, side)) Soil(patch, &(*images)[side]);
    for (const BlurFault& blur : blurs)
      if (Has(blur.camera, side)) Blur(blur.sigma_px, &(*images)[side]);
  }
}

}  // namespace turbidock::camera
