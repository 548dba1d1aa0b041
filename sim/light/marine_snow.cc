#include "sim/light/marine_snow.h"

#include <algorithm>
#include <cmath>

#include "sim/base/random.h"
#include "sim/light/water.h"

namespace turbidock::light {
namespace {

// Particles repeat themselves at this distance; they are seen to half of it.
constexpr double kCube_m = 3;
constexpr float kNearest_m = 0.08f;  // nearer ones would be out of any focus
// Spread of a point's light over pixels, besides the particle's own size.
constexpr float kPointSpread_px = 0.4f;

// The image nearest to the origin of a place that repeats itself.
double Wrapped(double x) { return x - kCube_m * std::round(x / kCube_m); }

}  // namespace

MarineSnow::MarineSnow(const SnowParams& params, double frame_s, uint64_t key)
    : params_(params), frame_s_(frame_s) {
  CheckFields(params, "snow");
  const auto count =
      static_cast<size_t>(std::lround(params.particles_per_m3 * kCube_m * kCube_m * kCube_m));
  Rng rng(key, 0);
  p_WF_.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    const double x = rng.Uniform(0, kCube_m), y = rng.Uniform(0, kCube_m);
    p_WF_.emplace_back(x, y, rng.Uniform(0, kCube_m));
  }
  p_HF_.reserve(count);
  irradiance_w_m2_.reserve(count);
}

void MarineSnow::Fall(const view::RenderedStereo& seen, int64_t frame, Water* water,
                      RadianceStereo* images) {
  if (!on()) return;
  const Eigen::Matrix3d R_HW = seen.X_WH.R().transpose();
  const double sunk_m = params_.sink_m_s * frame_s_ * static_cast<double>(frame);
  p_HF_.clear();
  for (const Eigen::Vector3d& p_WF : p_WF_) {
    Eigen::Vector3d p = p_WF - seen.X_WH.p;
    p.z() -= sunk_m;
    const Eigen::Vector3f p_HF = (R_HW * p.unaryExpr(&Wrapped)).cast<float>();
    if (p_HF.x() > kNearest_m) p_HF_.push_back(p_HF);
  }
  irradiance_w_m2_.resize(p_HF_.size());
  water->IrradianceFromAllSides(p_HF_, irradiance_w_m2_);
  const Eigen::Array3f extinction_per_m = water->medium().extinction_per_m().cast<float>();
  for (const Side side : kSides)
    Paint(water->rig()[side], seen[side], extinction_per_m, &(*images)[side]);
}

void MarineSnow::Paint(const MountedCamera& camera, const view::RenderedView& view,
                       const Eigen::Array3f& extinction_per_m, Image3f* image) const {
  const Eigen::Matrix3f R_CH = camera.X_HC.R().transpose().cast<float>();
  const Eigen::Vector3f p_HC = camera.X_HC.p.cast<float>();
  const auto radius_m = static_cast<float>(params_.diameter_m / 2);
  const auto fx_px = static_cast<float>(camera.fx_px), fy_px = static_cast<float>(camera.fy_px);
  for (size_t i = 0; i < p_HF_.size(); ++i) {
    const Eigen::Vector3f p_CF = R_CH * (p_HF_[i] - p_HC);
    const float z_m = p_CF.z();
    if (z_m < kNearest_m) continue;
    const float u = fx_px * p_CF.x() / z_m + static_cast<float>(camera.cx_px);
    const float v = fy_px * p_CF.y() / z_m + static_cast<float>(camera.cy_px);
    const int column = static_cast<int>(std::lround(u)), row = static_cast<int>(std::lround(v));
    if (!view.depth_m.Contains(column, row) || *view.depth_m.at(column, row) < z_m) continue;
    const float range_m = p_CF.norm();
    // what arrives over the solid angle of a pixel, cos^3 / f^2
    const Eigen::Array3f intensity_w_sr =
        static_cast<float>(params_.albedo) * irradiance_w_m2_[i] * (radius_m * radius_m / 4);
    const Eigen::Array3f sum = intensity_w_sr * (-extinction_per_m * range_m).exp() *
                               (fx_px * fy_px * range_m / (z_m * z_m * z_m));
    // a disc's deviation along an axis is half of its radius
    const float half_radius_px = fx_px * radius_m / (2 * z_m);
    const float sigma_px =
        std::sqrt(kPointSpread_px * kPointSpread_px + half_radius_px * half_radius_px);
    const int reach = static_cast<int>(std::ceil(3 * sigma_px));
    const auto weight = [&](int x, int y) {
      const float du = x - u, dv = y - v;
      return std::exp(-(du * du + dv * dv) / (2 * sigma_px * sigma_px));
    };
    float whole = 0;
    for (int y = row - reach; y <= row + reach; ++y)
      for (int x = column - reach; x <= column + reach; ++x) whole += weight(x, y);
    for (int y = std::max(0, row - reach); y <= std::min(camera.height_px - 1, row + reach); ++y)
      for (int x = std::max(0, column - reach); x <= std::min(camera.width_px - 1, column + reach);
           ++x) {
        float* rgb = image->at(x, y);
        for (int k = 0; k < 3; ++k) rgb[k] += sum[k] * weight(x, y) / whole;
      }
  }
}

}  // namespace turbidock::light
