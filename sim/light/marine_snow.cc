#include "sim/light/marine_snow.h"

#include <algorithm>
#include <array>
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
// Particles are sorted by cells of the cube, so many along an axis: blocks of them lie close
// together, and most are out of sight as a whole.
constexpr int kCellsAcross = 8;
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
  // Whether a box with edges along the axes may hold anything inside.
  bool Meets(const Eigen::Array3f& middle, const Eigen::Array3f& half) const {
    for (int k = 0; k < kPlanes; ++k) {
      float most = d[k];
      for (int i = 0; i < 3; ++i) most += n[k][i] * middle[i] + std::abs(n[k][i]) * half[i];
      if (most <= 0) return false;
    }
    return true;
  }
};

// In the frame W about the head.
Sight SightOf(const MountedCamera& camera, const PixelRegion& region, double radius_m,
              const Eigen::Matrix3d& R_WH) {
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
    const Eigen::Vector3d n_W = R_WH * n_H;
    for (int i = 0; i < 3; ++i) sight.n[k][i] = static_cast<float>(n_W[i]);
    sight.d[k] = static_cast<float>(planes(k, 3) - n_H.dot(camera.X_HC.p));
  }
  return sight;
}

struct Block {
  static constexpr int kSize = 64;
  float x_m[kSize], y_m[kSize], z_m[kSize];  // from the head, in W
  int in_sight[kSize];
};

[[gnu::always_inline]] inline float Wrapped(float x) {
  constexpr auto kSide_m = static_cast<float>(kCube_m), kHalf_m = kSide_m / 2;
  return x > kHalf_m ? x - kSide_m : x < -kHalf_m ? x + kSide_m : x;
}

// Of particles in the cube, their images nearest to the head.
TURBIDOCK_VECTOR_CLONES
void FindInSight(const Stereo<Sight>& sights, const float* head_m, int count,
                 const float* __restrict x_WF_m, const float* __restrict y_WF_m,
                 const float* __restrict z_WF_m, Block* __restrict block) {
  // copies, which nothing that is written to can be an alias of
  const Sight left = sights.left, right = sights.right;
  const float head_x = head_m[0], head_y = head_m[1], head_z = head_m[2];
  for (int i = 0; i < count; ++i) {
    const float x = Wrapped(x_WF_m[i] - head_x), y = Wrapped(y_WF_m[i] - head_y),
                z = Wrapped(z_WF_m[i] - head_z);
    block->x_m[i] = x;
    block->y_m[i] = y;
    block->z_m[i] = z;
    const float by_left = left.Inside(x, y, z), by_right = right.Inside(x, y, z);
    block->in_sight[i] = (by_left > 0.0f) | (by_right > 0.0f);
  }
}

// Of a particle's cell along an axis.
int CellAlong(float x_m) {
  return std::min(static_cast<int>(x_m * (kCellsAcross / kCube_m)), kCellsAcross - 1);
}

// Whether any of some particles may be in sight: they lie in the cells from the first one's to the
// last one's.
bool MayBeInSight(const Stereo<Sight>& sights, const Eigen::Array3f& head_m, int count,
                  const std::array<const float*, 3>& p_WF_m) {
  constexpr auto kHalf_m = static_cast<float>(kCube_m / 2), kRounding_m = 1e-3f;
  constexpr auto kHalfCell_m = static_cast<float>(kCube_m / kCellsAcross / 2);
  Eigen::Array3f middle, half;
  bool one = true;  // a single cell along the axes so far
  for (size_t i = 0; i < 3; ++i) {
    const int first = CellAlong(p_WF_m[i][0]), last = CellAlong(p_WF_m[i][count - 1]);
    const int from = one ? first : 0, to = one ? last + 1 : kCellsAcross;
    half[i] = kHalfCell_m * static_cast<float>(to - from) + kRounding_m;
    middle[i] = Wrapped(kHalfCell_m * static_cast<float>(from + to) - head_m[i]);
    // some may be at the other end
    if (std::abs(middle[i]) + half[i] > kHalf_m) middle[i] = 0, half[i] = kHalf_m;
    one = one && first == last;
  }
  return sights.left.Meets(middle, half) || sights.right.Meets(middle, half);
}

// Images of particles.
struct Seen {
  float u_px[Block::kSize], v_px[Block::kSize], sigma_px[Block::kSize], depth_m[Block::kSize];
  float radiance_w_m2_sr[3][Block::kSize];  // the sum over all pixels
  int bright[Block::kSize];                 // whether it is seen at all
};

TURBIDOCK_VECTOR_CLONES
void FindImages(const MountedCamera& camera, const SnowParams& params,
                const Eigen::Array3f& extinction_per_m, float faintest_w_m2_sr, int count,
                const float* __restrict p_HF, const float* __restrict irradiance_w_m2,
                Seen* __restrict seen) {
  const Eigen::Matrix3f R_HC = camera.X_HC.R().cast<float>();
  const Eigen::Vector3f p_HC = camera.X_HC.p.cast<float>();
  const Eigen::Vector4f lens =
      Eigen::Vector4d(camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px).cast<float>();
  const float fx = lens[0], fy = lens[1], cx = lens[2], cy = lens[3];
  const auto radius_m = static_cast<float>(params.diameter_m / 2);
  const float half_px = fx * radius_m / 2;
  // a disc's deviation along an axis is half of its radius; what arrives over the solid angle of a
  // pixel, cos^3 / f^2
  const float gain = static_cast<float>(params.albedo) * (radius_m * radius_m / 4) * fx * fy;
  for (int i = 0; i < count; ++i) {
    const float x = p_HF[3 * i] - p_HC[0], y = p_HF[3 * i + 1] - p_HC[1],
                z = p_HF[3 * i + 2] - p_HC[2];
    const auto along = [&](int axis) {
      return R_HC(0, axis) * x + R_HC(1, axis) * y + R_HC(2, axis) * z;
    };
    const float depth = along(2), per_depth = 1.0f / depth, size = half_px * per_depth;
    const float range = std::sqrt(x * x + y * y + z * z);
    const float var = kPointSpread_px * kPointSpread_px + size * size;
    const float arriving = gain * range * (per_depth * per_depth * per_depth);
    float most = 0.0f;
    for (int k = 0; k < 3; ++k) {
      const float radiance =
          arriving * irradiance_w_m2[3 * i + k] * ExpMinus(extinction_per_m[k] * range);
      seen->radiance_w_m2_sr[k][i] = radiance;
      most = most > radiance ? most : radiance;
    }
    seen->u_px[i] = fx * per_depth * along(0) + cx;
    seen->v_px[i] = fy * per_depth * along(1) + cy;
    seen->sigma_px[i] = std::sqrt(var);
    seen->depth_m[i] = depth;
    // a Gaussian's peak is its sum / (2 pi sigma^2)
    const float least = faintest_w_m2_sr * 2 * std::numbers::pi_v<float> * var;
    seen->bright[i] = (most >= least) & (depth >= kNearest_m);
  }
}

}  // namespace

MarineSnow::MarineSnow(const SnowParams& params, double frame_s, uint64_t key)
    : params_(params), frame_s_(frame_s) {
  CheckFields(params, "water.snow");
  const auto count =
      static_cast<size_t>(std::lround(params.particles_per_m3 * kCube_m * kCube_m * kCube_m));
  Rng rng(key, 0);
  std::vector<std::pair<int, std::array<float, 3>>> drawn(count);  // with their cells
  for (auto& [cell, place] : drawn)
    for (float& x : place) {
      x = static_cast<float>(rng.Uniform(0, kCube_m));
      cell = kCellsAcross * cell + CellAlong(x);
    }
  std::ranges::sort(drawn);
  for (const auto& [cell, place] : drawn) {
    x_WF_m_.push_back(place[0]), y_WF_m_.push_back(place[1]), z_WF_m_.push_back(place[2]);
  }
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
  const double sunk_m = params_.sink_mps * frame_s_ * static_cast<double>(frame);
  Gather(seen.X_WH, water->rig(), seen.drift_m - sunk_m * Eigen::Vector3d::UnitZ());
  irradiance_w_m2_.resize(p_HF_.size());
  water->IrradianceFromAllSides(p_HF_, irradiance_w_m2_);
  for (const Side side : kSides) Project(side, *water);
}

void MarineSnow::Gather(const Pose& X_WH, const StereoRig& rig, const Eigen::Vector3d& way_m) {
  const double radius_m = params_.diameter_m / 2;
  const Stereo<Sight> sights{SightOf(rig.left, region_.left, radius_m, X_WH.R()),
                             SightOf(rig.right, region_.right, radius_m, X_WH.R())};
  const Eigen::Matrix3f R_HW = X_WH.R().transpose().cast<float>();
  const Eigen::Array3d head_m = X_WH.p - way_m;
  const Eigen::Array3f in_cube_m = (head_m - kCube_m * (head_m / kCube_m).floor()).cast<float>();
  p_HF_.clear();
  Block block;
  for (size_t begin = 0; begin < x_WF_m_.size(); begin += Block::kSize) {
    const int count = static_cast<int>(std::min<size_t>(Block::kSize, x_WF_m_.size() - begin));
    const std::array<const float*, 3> p_WF_m = {&x_WF_m_[begin], &y_WF_m_[begin], &z_WF_m_[begin]};
    if (!MayBeInSight(sights, in_cube_m, count, p_WF_m)) continue;
    FindInSight(sights, in_cube_m.data(), count, p_WF_m[0], p_WF_m[1], p_WF_m[2], &block);
    for (int i = 0; i < count; ++i)
      if (block.in_sight[i])
        p_HF_.emplace_back(R_HW * Eigen::Vector3f(block.x_m[i], block.y_m[i], block.z_m[i]));
  }
}

void MarineSnow::Project(Side side, const Water& water) {
  const MountedCamera& camera = water.rig()[side];
  const PixelRegion& region = region_[side];
  Specks& specks = specks_[side];
  specks.all.clear();
  specks.first_of_band.assign(static_cast<size_t>(camera.height_px / TiledLight::kBandRows) + 1,
                              -1);
  const Eigen::Array3f extinction_per_m = water.medium().extinction_per_m().cast<float>();
  const float faintest_w_m2_sr =
      kFaintest * static_cast<float>(water.shading().absolute_tolerance_w_m2_sr);
  const double largest_px =
      std::hypot(kPointSpread_px, camera.fx_px * params_.diameter_m / (4 * kNearest_m));
  weights_.resize(std::max(weights_.size(),
                           static_cast<size_t>(4 * ReachOf(static_cast<float>(largest_px)) + 6)));
  Seen seen;
  for (size_t begin = 0; begin < p_HF_.size(); begin += Block::kSize) {
    const int count = static_cast<int>(std::min<size_t>(Block::kSize, p_HF_.size() - begin));
    FindImages(camera, params_, extinction_per_m, faintest_w_m2_sr, count, p_HF_[begin].data(),
               irradiance_w_m2_[begin].data(), &seen);
    for (int i = 0; i < count; ++i) {
      if (!seen.bright[i]) continue;
      Speck speck{.u_px = seen.u_px[i],
                  .v_px = seen.v_px[i],
                  .sigma_px = seen.sigma_px[i],
                  .depth_m = seen.depth_m[i]};
      for (int k = 0; k < 3; ++k) speck.radiance_w_m2_sr[k] = seen.radiance_w_m2_sr[k][i];
      speck.reach_px = ReachOf(speck.sigma_px);
      speck.column = static_cast<int>(std::floor(speck.u_px + 0.5f));
      speck.row = static_cast<int>(std::floor(speck.v_px + 0.5f));
      if (speck.column + speck.reach_px < region.column_begin ||
          speck.column - speck.reach_px >= region.column_end)
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
