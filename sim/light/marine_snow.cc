#include "sim/light/marine_snow.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/base/check.h"
#include "sim/base/random.h"
#include "sim/base/vector_clones.h"
#include "sim/base/vector_math.h"
#include "sim/light/tiles.h"
#include "sim/light/water.h"

namespace turbidock::light {
namespace {

// Particles repeat themselves at this distance; they are seen to half of it.
constexpr double kCube_m = 3;
constexpr float kNearest_m = 0.08f;  // nearer ones would be out of any focus
// Spread of a point's light over pixels, besides the particle's own size.
constexpr float kPointSpread_px = 0.4f;
constexpr float kReach_sigmas = 3;
// The least peak that is painted, in errors that shading may make in what is behind. By default it
// is one DN at black for the default camera, 2.5 for the published one at full gain, whose noise is
// four times that.
constexpr float kFaintest = 10;

int ReachOf(float sigma_px) { return static_cast<int>(std::ceil(kReach_sigmas * sigma_px)); }

// The half-spaces n . p_HF + d > 0 in which something of a particle may be seen in a region of a
// camera's image.
struct Sight {
  static constexpr int kPlanes = 5;
  float n[kPlanes][3] = {}, d[kPlanes] = {};

  [[gnu::always_inline]] float Inside(float x, float y, float z) const {
    float least = n[0][0] * x + n[0][1] * y + n[0][2] * z + d[0];
    for (int k = 1; k < kPlanes; ++k) {
      const float in = n[k][0] * x + n[k][1] * y + n[k][2] * z + d[k];
      least = in < least ? in : least;
    }
    return least;
  }
};

Sight SightOf(const MountedCamera& camera, const PixelRegion& region, double radius_m) {
  Sight sight;
  if (region.empty()) return sight;
  // A particle reaches as far as its point spread and its size together, and a pixel to round to.
  const double reach_px = double{kReach_sigmas * kPointSpread_px} + 2;
  const double reach_m = camera.fx_px * kReach_sigmas / 2 * radius_m;
  // Somewhat nearer than the nearest, which Project decides alone.
  const Eigen::Matrix<double, Sight::kPlanes, 4> planes{
      {0, 0, 1, -0.99 * double{kNearest_m}},
      {camera.fx_px, 0, camera.cx_px - region.column_begin + reach_px, reach_m},
      {-camera.fx_px, 0, region.column_end - camera.cx_px + reach_px, reach_m},
      {0, camera.fy_px, camera.cy_px - region.row_begin + reach_px, reach_m},
      {0, -camera.fy_px, region.row_end - camera.cy_px + reach_px, reach_m}};
  for (int k = 0; k < Sight::kPlanes; ++k) {
    const Eigen::Vector3d n_H = camera.X_HC.R() * planes.row(k).head<3>().transpose();
    for (int i = 0; i < 3; ++i) sight.n[k][i] = static_cast<float>(n_H[i]);
    sight.d[k] = static_cast<float>(planes(k, 3) - n_H.dot(camera.X_HC.p));
  }
  return sight;
}

struct Block {
  static constexpr int kSize = 256;
  float x_m[kSize], y_m[kSize], z_m[kSize];  // in H
  int in_sight[kSize];
};

// Of particles in the cube, their images nearest to the head.
TURBIDOCK_VECTOR_CLONES
void FindInSight(const Stereo<Sight>& sights, const float* R_HW, const float* head_m, int count,
                 const float* __restrict x_WF_m, const float* __restrict y_WF_m,
                 const float* __restrict z_WF_m, Block* __restrict block) {
  constexpr auto kSide_m = static_cast<float>(kCube_m), kHalf_m = kSide_m / 2;
  const auto wrapped = [](float x) {
    return x > kHalf_m ? x - kSide_m : x < -kHalf_m ? x + kSide_m : x;
  };
  // copies, which nothing that is written to can be an alias of
  const Sight left = sights.left, right = sights.right;
  float r[9];
  std::copy_n(R_HW, 9, r);
  const float head_x = head_m[0], head_y = head_m[1], head_z = head_m[2];
  for (int i = 0; i < count; ++i) {
    const float x = wrapped(x_WF_m[i] - head_x), y = wrapped(y_WF_m[i] - head_y),
                z = wrapped(z_WF_m[i] - head_z);
    const float x_H = r[0] * x + r[1] * y + r[2] * z, y_H = r[3] * x + r[4] * y + r[5] * z,
                z_H = r[6] * x + r[7] * y + r[8] * z;
    block->x_m[i] = x_H;
    block->y_m[i] = y_H;
    block->z_m[i] = z_H;
    const float by_left = left.Inside(x_H, y_H, z_H), by_right = right.Inside(x_H, y_H, z_H);
    block->in_sight[i] = (by_left > 0.0f) | (by_right > 0.0f);
  }
}

}  // namespace

MarineSnow::MarineSnow(const SnowParams& params, double frame_s, uint64_t key)
    : params_(params), frame_s_(frame_s) {
  CheckFields(params, "snow");
  const auto count =
      static_cast<size_t>(std::lround(params.particles_per_m3 * kCube_m * kCube_m * kCube_m));
  Rng rng(key, 0);
  for (size_t i = 0; i < count; ++i)
    for (std::vector<float>* to : {&x_WF_m_, &y_WF_m_, &z_WF_m_})
      to->push_back(static_cast<float>(rng.Uniform(0, kCube_m)));
  p_HF_.reserve(count);
  irradiance_w_m2_.reserve(count);
  // a speck is in every band that it reaches
  for (const Side side : kSides) specks_[side].all.reserve(2 * count + 1000);
}

void MarineSnow::Fall(const view::RenderedStereo& seen, const StereoRegion& region, int64_t frame,
                      Water* water) {
  if (!on()) return;
  seen_ = &seen;
  region_ = region;
  const double sunk_m = params_.sink_m_s * frame_s_ * static_cast<double>(frame);
  Gather(seen.X_WH, water->rig(), seen.drift_m - sunk_m * Eigen::Vector3d::UnitZ());
  irradiance_w_m2_.resize(p_HF_.size());
  water->IrradianceFromAllSides(p_HF_, irradiance_w_m2_);
  for (const Side side : kSides) Project(side, *water);
}

void MarineSnow::Gather(const Pose& X_WH, const StereoRig& rig, const Eigen::Vector3d& way_m) {
  const double radius_m = params_.diameter_m / 2;
  const Stereo<Sight> sights{SightOf(rig.left, region_.left, radius_m),
                             SightOf(rig.right, region_.right, radius_m)};
  const Eigen::Matrix<float, 3, 3, Eigen::RowMajor> R_HW = X_WH.R().transpose().cast<float>();
  const Eigen::Array3d head_m = X_WH.p - way_m;
  const Eigen::Array3f in_cube_m = (head_m - kCube_m * (head_m / kCube_m).floor()).cast<float>();
  p_HF_.clear();
  Block block;
  for (size_t begin = 0; begin < x_WF_m_.size(); begin += Block::kSize) {
    const int count = static_cast<int>(std::min<size_t>(Block::kSize, x_WF_m_.size() - begin));
    FindInSight(sights, R_HW.data(), in_cube_m.data(), count, &x_WF_m_[begin], &y_WF_m_[begin],
                &z_WF_m_[begin], &block);
    for (int i = 0; i < count; ++i)
      if (block.in_sight[i]) p_HF_.emplace_back(block.x_m[i], block.y_m[i], block.z_m[i]);
  }
}

void MarineSnow::Project(Side side, const Water& water) {
  const MountedCamera& camera = water.rig()[side];
  const PixelRegion& region = region_[side];
  Specks& specks = specks_[side];
  specks.all.clear();
  specks.first_of_band.assign(static_cast<size_t>(camera.height_px / TiledLight::kBandRows) + 1,
                              -1);
  const Eigen::Matrix3f R_CH = camera.X_HC.R().transpose().cast<float>();
  const Eigen::Vector3f p_HC = camera.X_HC.p.cast<float>();
  const Eigen::Array3f extinction_per_m = water.medium().extinction_per_m().cast<float>();
  const float faintest_w_m2_sr =
      kFaintest * static_cast<float>(water.shading().absolute_tolerance_w_m2_sr);
  const auto radius_m = static_cast<float>(params_.diameter_m / 2);
  const auto fx_px = static_cast<float>(camera.fx_px), fy_px = static_cast<float>(camera.fy_px);
  const auto sigma_px = [&](float z_m) {
    // a disc's deviation along an axis is half of its radius
    return std::hypot(kPointSpread_px, fx_px * radius_m / (2 * z_m));
  };
  weights_.resize(
      std::max(weights_.size(), static_cast<size_t>(4 * ReachOf(sigma_px(kNearest_m)) + 2)));
  for (size_t i = 0; i < p_HF_.size(); ++i) {
    const Eigen::Vector3f p_CF = R_CH * (p_HF_[i] - p_HC);
    const float z_m = p_CF.z();
    if (z_m < kNearest_m) continue;
    Speck speck{.u_px = fx_px * p_CF.x() / z_m + static_cast<float>(camera.cx_px),
                .v_px = fy_px * p_CF.y() / z_m + static_cast<float>(camera.cy_px),
                .sigma_px = sigma_px(z_m),
                .depth_m = z_m};
    speck.reach_px = ReachOf(speck.sigma_px);
    speck.column = static_cast<int>(std::floor(speck.u_px + 0.5f));
    speck.row = static_cast<int>(std::floor(speck.v_px + 0.5f));
    if (speck.column + speck.reach_px < region.column_begin ||
        speck.column - speck.reach_px >= region.column_end)
      continue;
    const float range_m = p_CF.norm();
    // what arrives over the solid angle of a pixel, cos^3 / f^2
    const Eigen::Array3f intensity_w_sr =
        static_cast<float>(params_.albedo) * irradiance_w_m2_[i] * (radius_m * radius_m / 4);
    speck.radiance_w_m2_sr = intensity_w_sr * (-extinction_per_m * range_m).exp() *
                             (fx_px * fy_px * range_m / (z_m * z_m * z_m));
    // a Gaussian's peak is its sum / (2 pi sigma^2)
    if (speck.radiance_w_m2_sr.maxCoeff() <
        faintest_w_m2_sr * 2 * std::numbers::pi_v<float> * speck.sigma_px * speck.sigma_px)
      continue;
    const int first = std::max(region.row_begin, speck.row - speck.reach_px),
              last = std::min(region.row_end - 1, speck.row + speck.reach_px);
    for (int band = first / TiledLight::kBandRows;
         first <= last && band <= last / TiledLight::kBandRows; ++band) {
      int& newest = specks.first_of_band[static_cast<size_t>(band)];
      speck.next = std::exchange(newest, static_cast<int>(specks.all.size()));
      specks.all.push_back(speck);
    }
  }
}

void MarineSnow::PaintRows(Side side, int row_begin, int row_end, float* rgb) {
  if (!on()) return;
  const ptrdiff_t width = (*seen_)[side].depth_m.width();
  Paint(side, {rgb, 3 * width, 1, width, row_begin, row_end});
}

void MarineSnow::Paint(RadianceStereo* images) {
  if (!on()) return;
  for (const Side side : kSides) {
    Image3f& image = (*images)[side];
    for (int v = 0; v < image.height(); v += TiledLight::kBandRows)
      Paint(side, {image.row(v), ptrdiff_t{3} * image.width(), 3, 1, v,
                   std::min(v + TiledLight::kBandRows, image.height())});
  }
}

void MarineSnow::Paint(Side side, const Rows& rows) {
  TD_CHECK(seen_ && rows.begin % TiledLight::kBandRows == 0 &&
               rows.end - rows.begin <= TiledLight::kBandRows,
           "a band of rows after Fall");
  const Image1f& depth_m = (*seen_)[side].depth_m;
  const PixelRegion& region = region_[side];
  const Specks& specks = specks_[side];
  int next = specks.first_of_band[static_cast<size_t>(rows.begin / TiledLight::kBandRows)];
  while (next >= 0) {
    const Speck& speck = specks.all[static_cast<size_t>(next)];
    next = speck.next;
    // A Gaussian is a product of what depends on the column and what depends on the row.
    const int side_px = 2 * speck.reach_px + 1;
    const int left = speck.column - speck.reach_px, top = speck.row - speck.reach_px;
    float *of_column = weights_.data(), *of_row = of_column + side_px;
    float columns = 0, all_rows = 0;
    const float per_two_var = 1 / (2 * speck.sigma_px * speck.sigma_px);
    for (int i = 0; i < side_px; ++i) {
      const float du = static_cast<float>(left + i) - speck.u_px,
                  dv = static_cast<float>(top + i) - speck.v_px;
      columns += of_column[i] = ExpMinus(du * du * per_two_var);
      all_rows += of_row[i] = ExpMinus(dv * dv * per_two_var);
    }
    const int begin = std::max(region.column_begin, left),
              end = std::min(region.column_end, left + side_px);
    for (int v = std::max({region.row_begin, rows.begin, top});
         v < std::min({region.row_end, rows.end, top + side_px}); ++v) {
      const Eigen::Array3f rgb = speck.radiance_w_m2_sr * (of_row[v - top] / (columns * all_rows));
      for (int u = begin; u < end; ++u) {
        if (*depth_m.at(u, v) < speck.depth_m) continue;
        float* to = rows.first + (v - rows.begin) * rows.per_row + u * rows.per_column;
        for (int k = 0; k < 3; ++k) to[k * rows.per_channel] += rgb[k] * of_column[u - left];
      }
    }
  }
}

}  // namespace turbidock::light
