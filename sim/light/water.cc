#include "sim/light/water.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>

#include "sim/base/check.h"

namespace turbidock::light {
namespace {

// Distance of the pixels that are metered: half of a ball's disc at 1 m in the default rig.
constexpr int kMeter_px = 10;
// The least peak of a spread ball that is added, in errors that shading may make: by default half a
// DN at black for the published camera at full gain, less for the default one.
constexpr float kFaintest = 2;

void Load(const LightPoint& point, int i, PointBatch* batch) {
  batch->u_px[i] = point.u;
  batch->v_px[i] = point.v;
  batch->depth_m[i] = point.depth_m;
}

// I = Int L dA over the disc.
Glow GlowOf(const Rgb& rim_w_m2_sr, const Rgb& core_w_m2_sr, double core_width_m, double radius_m) {
  const double two_var_m2 = 2 * core_width_m * core_width_m;
  return {.radius_m = radius_m,
          .intensity_w_sr =
              std::numbers::pi *
              (radius_m * radius_m * rim_w_m2_sr +
               two_var_m2 * (1 - std::exp(-radius_m * radius_m / two_var_m2)) * core_w_m2_sr)};
}

SpreadBall SpreadOf(const ForwardPeak& peak, const BallLightParams& lights, double radius_m) {
  const double per_width = radius_m / lights.core_width_m;
  return {peak, radius_m, [&](double r) {
            return lights.rim_radiance_w_m2_sr +
                   lights.core_radiance_w_m2_sr * std::exp(-0.5 * std::pow(r * per_width, 2));
          }};
}

// With the last point, to a whole vector.
void FillUp(int count, PointBatch* batch) {
  batch->count = (count + PointBatch::kVector - 1) / PointBatch::kVector * PointBatch::kVector;
  for (float* values : {batch->u_px, batch->v_px, batch->depth_m})
    std::fill(values + count, values + batch->count, values[count - 1]);
}

}  // namespace

Water::Water(const OpticsParams& params, const StereoRig& rig, const SurfaceTable& surfaces,
             const std::vector<Pose>& X_HE, const std::vector<double>& lamp_factors)
    : batch_{},
      params_(params),
      rig_(rig),
      surfaces_(surfaces),
      cameras_(rig.Each([](const MountedCamera& camera) {
        return Camera{camera, RayFrame(camera), {}, {}, {}, {}, {}};
      })) {
  CheckFields(params_, "");
  medium_ = MakeMedium(params_.water);
  image_loss_per_m_ = medium_.image_loss_per_m().cast<float>();
  lighting_loss_per_m_ = medium_.lighting_loss_per_m().cast<float>();
  halo_loss_per_m_ = medium_.halo_loss_per_m().cast<float>();
  scatters_ = medium_.scattering_per_m.maxCoeff() > 0;

  if (params_.lamps.enabled)
    for (size_t i = 0; i < X_HE.size(); ++i)
      lamps_.push_back(LampOf(X_HE[i], i < lamp_factors.size() ? lamp_factors[i] : 1));

  if (scatters_ && !lamps_.empty())
    for (const Side side : kSides)
      cameras_[side].veil.emplace(medium_, lamps_, params_.water.port_m, rig[side]);

  const BallLightParams& lights = params_.ball_lights;
  if (lights.enabled) {
    for (size_t i = 0; i < lights.balls.size(); ++i) {
      const BallLight& light = lights.balls[i];
      LitBall ball;
      ball.geom = surfaces_.Find("ball_" + light.name);
      if (ball.geom < 0 || surfaces_[ball.geom].shape != Shape::kSphere)
        throw ConfigError("lights.marker.balls[" + std::to_string(i) + "].name",
                          "the scene has no sphere ball_" + light.name);
      const Rgb color = light.current_factor * light.color.array();
      const Rgb rim_w_m2_sr = lights.rim_radiance_w_m2_sr * color;
      const Rgb core_w_m2_sr = lights.core_radiance_w_m2_sr * color;
      ball.disc = {rim_w_m2_sr.cast<float>(), core_w_m2_sr.cast<float>(),
                   static_cast<float>(lights.core_width_m),
                   static_cast<float>(medium_.peak.scattering_per_m)};
      const double radius_m = surfaces_[ball.geom].size_m[0];
      ball.glow = GlowOf(rim_w_m2_sr, core_w_m2_sr, lights.core_width_m, radius_m);
      if (scatters_) {
        auto halo = std::find_if(halos_.begin(), halos_.end(),
                                 [&](const auto& known) { return known.first == radius_m; });
        if (halo == halos_.end()) {
          const Glow unit{.radius_m = radius_m, .intensity_w_sr = Rgb::Ones()};
          halos_.emplace_back(radius_m, HaloTable(medium_, unit));
          halo = std::prev(halos_.end());
          if (medium_.peak.scattering_per_m > 0)
            spread_balls_.push_back(SpreadOf(medium_.peak, lights, radius_m));
        }
        ball.halo = static_cast<size_t>(halo - halos_.begin());
      }
      lit_balls_.push_back(ball);
      // others that have its light
      for (int geom = 0; geom < surfaces_.size(); ++geom) {
        if (surfaces_[geom].shines_as != light.name) continue;
        ball.geom = geom;
        lit_balls_.push_back(ball);
      }
    }
  }

  for (int geom = 0; geom < surfaces_.size(); ++geom)
    if (surfaces_[geom].casts_shadow) {
      casters_.push_back(geom);
      if (surfaces_[geom].shape == Shape::kBox && shadow_box_ < 0) shadow_box_ = geom;
    }
  placed_.resize(static_cast<size_t>(surfaces_.size()));
  present_.assign(static_cast<size_t>(surfaces_.size()), true);
  first_of_surface_.reserve(static_cast<size_t>(surfaces_.size()) + 2);
  order_.reserve(static_cast<size_t>(rig.left.width_px) * rig.left.height_px);
  if (scatters_ && !lamps_.empty() && params_.water.surface_halos)
    reflectors_ = Reflectors(surfaces_, medium_);
}

Lamp Water::LampOf(const Pose& X_HE_of_scene, double factor) const {
  const Pose X_HE = PlaceLamp(X_HE_of_scene, params_.lamps);
  Lamp lamp{X_HE.p, X_HE.q * Eigen::Vector3d::UnitX(), params_.lamps,
            OwnShadow(PartsBefore(surfaces_, X_HE_of_scene, X_HE), X_HE, rig_)};
  lamp.beam.intensity_w_sr *= factor;
  return lamp;
}

StereoRegion Water::Seen(const StereoRegion& region) const {
  // A tile's far corner is the next one's first pixel.
  const auto grown = [&](const PixelRegion& r, const CameraIntrinsics& camera) -> PixelRegion {
    const PixelRegion tiles = WholeTiles(r, camera);
    return {tiles.column_begin, tiles.row_begin, std::min(tiles.column_end + 1, camera.width_px),
            std::min(tiles.row_end + 1, camera.height_px)};
  };
  return {grown(region.left, rig_.left), grown(region.right, rig_.right)};
}

PixelRegion Water::WholeTiles(const PixelRegion& region, const CameraIntrinsics& camera) const {
  if (region.empty()) return {};
  const int most_px = 2 * params_.shading.tile_px;
  const int tile_px = std::max(SurfacePyramid::kCell_px,
                               static_cast<int>(std::bit_floor(static_cast<unsigned>(most_px))));
  const auto down = [&](int x) { return x / tile_px * tile_px; };
  const auto up = [&](int x) { return (x + tile_px - 1) / tile_px * tile_px; };
  return {down(region.column_begin), down(region.row_begin),
          std::min(up(region.column_end), camera.width_px),
          std::min(up(region.row_end), camera.height_px)};
}

int64_t Water::points() const {
  int64_t sum = 0;
  for (const Side side : kSides)
    sum += cameras_[side].surface_light.points() + cameras_[side].water_light.points();
  return sum;
}

void Water::Apply(const view::RenderedStereo& rendered, RadianceStereo* out) {
  Prepare(rendered, whole());
  for (const Side side : kSides) {
    const int width = rig_[side].width_px, height = rig_[side].height_px;
    Image3f& image = (*out)[side];
    image.Resize(width, height);
    band_.resize(static_cast<size_t>(TiledLight::kBandRows) * width * 3);
    for (int v = 0; v < height; v += TiledLight::kBandRows) {
      const int end = std::min(v + TiledLight::kBandRows, height);
      PaintRows(side, v, end, band_.data());
      const float* from = band_.data();
      for (int row = v; row < end; ++row)
        for (int k = 0; k < 3; ++k)
          for (int u = 0; u < width; ++u) image.at(u, row)[k] = std::max(0.0f, *from++);
    }
  }
}

void Water::Prepare(const view::RenderedStereo& rendered, const StereoRegion& region) {
  Place(rendered);
  reflectors_.Illuminate(surfaces_, placed_, lamps_, casters_, &batch_);
  for (const Side side : kSides) {
    Spread(&cameras_[side]);
    PrepareView(rendered[side], region[side], &cameras_[side]);
  }
}

std::span<const Eigen::Array3f> Water::MeteredRadiance(const view::RenderedStereo& rendered) {
  metered_radiance_.clear();
  const auto add = [&](size_t first) {
    for (const Light& light : metered_light_) metered_radiance_[first++] += light.head<3>();
  };
  std::vector<LightPoint>& points = metered_;
  for (const Side side : kSides) {
    const view::RenderedView& view = rendered[side];
    points.clear();
    for (int v = kMeter_px / 2; v < view.surface.height(); v += kMeter_px)
      for (int u = kMeter_px / 2; u < view.surface.width(); u += kMeter_px)
        points.push_back({static_cast<uint16_t>(u), static_cast<uint16_t>(v),
                          *view.surface.at(u, v), *view.depth_m.at(u, v)});
    const size_t first = metered_radiance_.size();
    metered_radiance_.resize(first + points.size(), Eigen::Array3f::Zero());
    metered_light_.assign(points.size(), Light::Zero());
    ShineFromSurfaces(cameras_[side], points, metered_light_.data());
    add(first);
    if (scatters_) {
      ShineFromWater(cameras_[side], points, metered_light_.data());
      add(first);
    }
  }
  return metered_radiance_;
}

void Water::IrradianceFromAllSides(std::span<const Eigen::Vector3f> p_HQ,
                                   std::span<Eigen::Array3f> out_w_m2) {
  PointBatch& batch = batch_;
  for (size_t begin = 0; begin < p_HQ.size(); begin += PointBatch::kSize) {
    const auto part = p_HQ.subspan(begin, std::min<size_t>(PointBatch::kSize, p_HQ.size() - begin));
    const int count = static_cast<int>(part.size());
    FillUp(count, &batch);
    for (int i = 0; i < batch.count; ++i) {
      const Eigen::Vector3f& p = part[static_cast<size_t>(std::min(i, count - 1))];
      batch.x_m[i] = p.x(), batch.y_m[i] = p.y(), batch.z_m[i] = p.z();
    }
    batch.Darken();
    const auto face = [&](const Eigen::Vector3f& p_HSource) {
      for (int i = 0; i < batch.count; ++i) {
        const Eigen::Vector3f normal =
            (p_HSource - Eigen::Vector3f(batch.x_m[i], batch.y_m[i], batch.z_m[i])).normalized();
        batch.normal_x[i] = normal.x();
        batch.normal_y[i] = normal.y();
        batch.normal_z[i] = normal.z();
      }
    };
    const Bounds lit = BoundsOf(batch);
    for (const Lamp& lamp : lamps_) {
      const Eigen::Vector3f p_HE = lamp.p_HE.cast<float>();
      face(p_HE);
      CastShadows(-1, -1, p_HE, lit, &batch);
      AddLampIrradiance(lamp, lighting_loss_per_m_, &batch);
    }
    for (const LitBall& ball : lit_balls_) {
      if (!IsPresent(ball)) continue;
      const Eigen::Vector3f& p_HBall = placed_[static_cast<size_t>(ball.geom)].p_HS;
      face(p_HBall);
      CastShadows(-1, ball.geom, p_HBall, lit, &batch);
      AddBallIrradiance(ball.glow, lighting_loss_per_m_, p_HBall, &batch);
    }
    for (int i = 0; i < count; ++i)
      out_w_m2[begin + static_cast<size_t>(i)] = {batch.red[i], batch.green[i], batch.blue[i]};
  }
}

void Water::PaintRows(Side side, int row_begin, int row_end, float* rgb) const {
  const Camera& camera = cameras_[side];
  using Mode = TiledLight::Mode;
  if (scatters_) camera.water_light.Paint(row_begin, row_end, Mode::kWrite, rgb);
  camera.surface_light.Paint(row_begin, row_end, scatters_ ? Mode::kAdd : Mode::kWrite, rgb);
}

void Water::Place(const view::RenderedStereo& rendered) {
  const Pose X_HW = rendered.X_WH.Inverse();
  const Pose X_HK = X_HW * rendered.X_WK;
  up_H_ = (X_HW.q * Eigen::Vector3d::UnitZ()).cast<float>();
  const int distractors = static_cast<int>(rendered.distractors.size());
  const int first_distractor = surfaces_.size() - distractors;
  TD_CHECK(first_distractor >= 0, "distractors that the water does not know");
  for (int geom = 0; geom < surfaces_.size(); ++geom) {
    const Surface& surface = surfaces_[geom];
    Pose X_HS = surface.X_AS;
    if (surface.fixed_to == FixedTo::kWorld) X_HS = X_HW * surface.X_AS;
    if (surface.fixed_to == FixedTo::kMooredBody) X_HS = X_HK * surface.X_AS;
    if (geom >= first_distractor) {
      const auto& distractor = rendered.distractors[static_cast<size_t>(geom - first_distractor)];
      X_HS = X_HW * distractor.X_WV;
      present_[static_cast<size_t>(geom)] = distractor.present;
    }
    placed_[static_cast<size_t>(geom)] = {X_HS.R().cast<float>(), X_HS.p.cast<float>()};
  }
}

void Water::SetDaylight(const Eigen::Array3d& irradiance_w_m2) {
  day_ = irradiance_w_m2.maxCoeff() > 0;
  daylight_w_m2_ = irradiance_w_m2.cast<float>();
  const Rgb loss_per_m = medium_.image_loss_per_m().max(1e-12);
  const Rgb veil_w_m2_sr = medium_.scattering_per_m / loss_per_m * irradiance_w_m2;
  day_veil_w_m2_sr_ = (veil_w_m2_sr / (2 * std::numbers::pi)).cast<float>();
}

void Water::PrepareView(const view::RenderedView& view, const PixelRegion& region, Camera* camera) {
  const int width = camera->width_px, height = camera->height_px;
  TD_CHECK(view.surface.width() == width && view.surface.height() == height &&
               view.depth_m.width() == width && view.depth_m.height() == height,
           "the rendered view has another size than the rig's camera");
  const ShadingParams& shading = params_.shading;
  const int tile_px = shading.tile_px;
  camera->pyramid.Build(view.surface, WholeTiles(region, *camera));
  TileRules rules{.largest_px = tile_px,
                  .mixed_px = 0,
                  .nothing_is_dark = true,
                  .relative_tolerance = static_cast<float>(shading.relative_tolerance),
                  .absolute_tolerance = static_cast<float>(shading.absolute_tolerance_w_m2_sr)};
  const auto spread = [&](TiledLight* tiles, const auto& shine) {
    tiles->Spread(view.surface, view.depth_m, camera->pyramid, region, rules, shine);
  };
  spread(&camera->surface_light, [&](std::span<const LightPoint> points, Light* light) {
    ShineFromSurfaces(*camera, points, light);
  });
  if (!scatters_) return;
  // apart, because it is smooth where surfaces are not: it depends on their distance only
  rules.largest_px = tile_px > 1 ? 2 * tile_px : 1;
  rules.mixed_px = tile_px / 2;
  rules.nothing_is_dark = false;
  spread(&camera->water_light, [&](std::span<const LightPoint> points, Light* light) {
    ShineFromWater(*camera, points, light);
  });
}

// What comes straight from surfaces, attenuated after Beer and Lambert. Batches of one surface
// each.
void Water::ShineFromSurfaces(const Camera& camera, std::span<const LightPoint> points,
                              Light* light) {
  std::vector<int>& first = first_of_surface_;
  first.assign(static_cast<size_t>(surfaces_.size()) + 2, 0);
  for (const LightPoint& point : points) ++first[point.surface + 1u];
  for (size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  order_.resize(points.size());
  for (size_t i = 0; i < points.size(); ++i)
    order_[static_cast<size_t>(first[points[i].surface]++)] = static_cast<int>(i);
  // now first[id] is where the points of `id` end

  for (int i = 0; i < first[0]; ++i) light[order_[static_cast<size_t>(i)]].setZero();
  for (int geom = 0; geom < surfaces_.size(); ++geom) {
    const int end = first[static_cast<size_t>(geom) + 1];
    for (int begin = first[static_cast<size_t>(geom)]; begin < end; begin += PointBatch::kSize) {
      const int count = std::min(end - begin, PointBatch::kSize);
      const int* index = &order_[static_cast<size_t>(begin)];
      for (int i = 0; i < count; ++i) Load(points[static_cast<size_t>(index[i])], i, &batch_);
      FillUp(count, &batch_);
      ShineFromSurface(camera, geom, &batch_);
      for (int i = 0; i < count; ++i)
        light[index[i]] = Light(batch_.red[i], batch_.green[i], batch_.blue[i], 0);
    }
  }
}

void Water::ShineFromSurface(const Camera& camera, int geom, PointBatch* batch) const {
  const Surface& surface = surfaces_[geom];
  FindRays(camera.rays, batch);
  FindNormals(surface, placed_[static_cast<size_t>(geom)], batch);
  batch->Darken();
  const Bounds bounds = BoundsOf(*batch);
  for (const Lamp& lamp : lamps_) {
    CastShadows(geom, -1, lamp.p_HE.cast<float>(), bounds, batch);
    AddLampIrradiance(lamp, lighting_loss_per_m_, batch);
  }
  const LitBall* lit = nullptr;
  for (const LitBall& ball : lit_balls_) {
    if (ball.geom == geom) {
      lit = &ball;
      continue;
    }
    if (!IsPresent(ball)) continue;
    const Eigen::Vector3f& p_HBall = placed_[static_cast<size_t>(ball.geom)].p_HS;
    CastShadows(geom, ball.geom, p_HBall, bounds, batch);
    AddBallIrradiance(ball.glow, lighting_loss_per_m_, p_HBall, batch);
  }
  if (day_)
    for (int i = 0; i < batch->count; ++i) {
      const float share =
          0.5f + 0.5f * (batch->normal_x[i] * up_H_.x() + batch->normal_y[i] * up_H_.y() +
                         batch->normal_z[i] * up_H_.z());
      batch->red[i] += share * daylight_w_m2_[0];
      batch->green[i] += share * daylight_w_m2_[1];
      batch->blue[i] += share * daylight_w_m2_[2];
    }
  Scale(surface.albedo.cast<float>().array() / std::numbers::pi_v<float>, batch);
  if (lit != nullptr)
    AddBallDisc(lit->disc, camera.rays, placed_[static_cast<size_t>(geom)].p_HS, batch);
  Attenuate(image_loss_per_m_, batch);
}

// Whether the marker stands between lit points and the light. Convex surfaces do not shade
// themselves.
void Water::CastShadows(int lit_geom, int source_geom, const Eigen::Vector3f& p_HSource,
                        const Bounds& lit, PointBatch* batch) const {
  std::fill_n(batch->visible, batch->count, 1.0f);
  for (const int geom : casters_) {
    const PlacedSurface& placed = placed_[static_cast<size_t>(geom)];
    if (geom != lit_geom && geom != source_geom && MayHide(surfaces_[geom], placed, p_HSource, lit))
      CastShadow(surfaces_[geom], placed, p_HSource, batch);
  }
}

// How the forward peak spreads the balls that a camera sees, or some of: parts of the marker may
// stand before them.
void Water::Spread(Camera* camera) {
  if (spread_balls_.empty()) return;
  const float least_w_m2_sr =
      kFaintest * static_cast<float>(params_.shading.absolute_tolerance_w_m2_sr);
  camera->spread.assign(lit_balls_.size(), {});
  for (size_t k = 0; k < lit_balls_.size(); ++k) {
    const LitBall& ball = lit_balls_[k];
    if (!IsPresent(ball)) continue;
    const Eigen::Vector3f& p_HBall = placed_[static_cast<size_t>(ball.geom)].p_HS;
    const Eigen::Vector3f to_ball = p_HBall - camera->rays.p_HC;
    const auto radius_m = static_cast<float>(ball.glow.radius_m);
    const float way_m = to_ball.norm() - radius_m;
    if (way_m <= 0) continue;
    // evenly over the disc
    batch_.count = PointBatch::kVector;
    const Eigen::Vector3f across = to_ball.unitOrthogonal(),
                          up = across.cross(to_ball).normalized();
    for (int i = 0; i < batch_.count; ++i) {
      const float r_m = radius_m * std::sqrt((static_cast<float>(i) + 0.5f) / PointBatch::kVector);
      const float angle_rad =
          std::numbers::pi_v<float> * (3 - std::sqrt(5.0f)) * static_cast<float>(i);
      const Eigen::Vector3f p_HQ =
          p_HBall + r_m * (std::cos(angle_rad) * across + std::sin(angle_rad) * up);
      batch_.x_m[i] = p_HQ.x(), batch_.y_m[i] = p_HQ.y(), batch_.z_m[i] = p_HQ.z();
    }
    CastShadows(ball.geom, -1, camera->rays.p_HC, BoundsOf(batch_), &batch_);
    const float seen = std::accumulate(batch_.visible, batch_.visible + batch_.count, 0.0f) /
                       static_cast<float>(batch_.count);
    SpreadImage& spread = camera->spread[k];
    spread.radius_m = radius_m;
    spread.way_m = way_m;
    spread.profile = spread_balls_[ball.halo].At(way_m);
    spread.intensity_w_sr =
        seen * ball.glow.intensity_w_sr.cast<float>() * (-image_loss_per_m_ * way_m).exp();
    if (spread.intensity_w_sr.maxCoeff() * *std::ranges::max_element(spread.profile) <
        least_w_m2_sr)
      spread.intensity_w_sr.setZero();
  }
}

// What the water on the way scatters into rays.
void Water::ShineFromWater(const Camera& camera, std::span<const LightPoint> points, Light* light) {
  PointBatch& batch = batch_;
  for (size_t begin = 0; begin < points.size(); begin += PointBatch::kSize) {
    const int count =
        static_cast<int>(std::min(points.size() - begin, static_cast<size_t>(PointBatch::kSize)));
    for (int i = 0; i < count; ++i) Load(points[begin + static_cast<size_t>(i)], i, &batch);
    FillUp(count, &batch);
    FindRays(camera.rays, &batch);
    Light* out = light + begin;
    if (camera.veil)
      for (int i = 0; i < count; ++i)
        out[i] = camera.veil->At(batch.u_px[i], batch.v_px[i], batch.range_m[i]);
    else
      std::fill_n(out, count, Light::Zero());
    if (day_)
      for (int i = 0; i < count; ++i)
        out[i].head<3>() += day_veil_w_m2_sr_ * (1 - (-image_loss_per_m_ * batch.range_m[i]).exp());
    reflectors_.AddHalos(camera.rays, count, &batch, out);
    for (size_t k = 0; k < lit_balls_.size(); ++k) {
      const LitBall& ball = lit_balls_[k];
      if (!IsPresent(ball)) continue;
      const PlacedSurface& placed = placed_[static_cast<size_t>(ball.geom)];
      // not lit: what the marker's box hides from the ball
      std::optional<BoxShadow> shadow;
      if (shadow_box_ >= 0) {
        const PlacedSurface& box = placed_[static_cast<size_t>(shadow_box_)];
        const Eigen::Matrix3d R_HS = box.R_HS.cast<double>();
        const auto in_box = [&](const Eigen::Vector3f& p_HQ) -> Eigen::Vector3d {
          return R_HS.transpose() * (p_HQ - box.p_HS).cast<double>();
        };
        shadow.emplace(surfaces_[shadow_box_], R_HS, in_box(placed.p_HS), in_box(camera.rays.p_HC));
      }
      const bool in_sea = !camera.spread.empty();
      AddHalo(camera.rays, placed.p_HS,
              SeenFrom((placed.p_HS - camera.rays.p_HC).norm(), medium_, ball.glow),
              halo_loss_per_m_, halos_[ball.halo].second, shadow ? &*shadow : nullptr, count,
              &batch, out);
      if (in_sea && camera.spread[k].intensity_w_sr.maxCoeff() > 0)
        AddSpread(camera.rays, placed.p_HS, camera.spread[k], count, &batch, out);
    }
  }
}

}  // namespace turbidock::light
