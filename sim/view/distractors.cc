#include "sim/view/distractors.h"

#include <algorithm>
#include <cmath>

#include "sim/base/random.h"

namespace turbidock::view {
namespace {

using Eigen::Vector3d;

// The marker's balls and boxes where the model has them.
std::vector<Distractor> CopyOfMarker(const vehicle::Scene& scene, const std::string& name,
                                     const FaultSpan& span) {
  const mjModel& model = *scene.model;
  const vehicle::MjDataPtr data(mj_makeData(&model));
  mj_kinematics(&model, data.get());
  std::vector<Distractor> copy;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (scene.geom_part[static_cast<size_t>(geom)] != vehicle::Part::kMarker) continue;
    const bool ball = model.geom_type[geom] == mjGEOM_SPHERE;
    if (!ball && model.geom_type[geom] != mjGEOM_BOX)
      throw ConfigError("faults", "a marker of other shapes than balls and boxes has no copy");
    mjtNum quat[4];
    mju_mat2Quat(quat, data->geom_xmat + 9 * geom);
    const Vector3d size = Vector3d::Map(model.geom_size + 3 * geom);
    Distractor part{.name = name + "_" + std::to_string(geom),
                    .span = span,
                    .ball = ball,
                    .half_size_m = ball ? Vector3d::Constant(size[0]) : size,
                    .albedo = Eigen::Vector3f::Map(model.geom_rgba + 4 * geom).cast<double>(),
                    .shines_as = "",
                    .X_WV = {Eigen::Quaterniond(quat[0], quat[1], quat[2], quat[3]),
                             Vector3d::Map(data->geom_xpos + 3 * geom)}};
    for (const vehicle::BallInScene& lit : scene.balls)
      if (lit.geom == geom) part.shines_as = lit.name;
    copy.push_back(part);
  }
  return copy;
}

Pose Reflected(const Pose& X, double height_m) {
  const Eigen::Matrix3d S = Vector3d(1, 1, -1).asDiagonal();
  return {Eigen::Quaterniond(Eigen::Matrix3d(S * X.R() * S)),
          {X.p.x(), X.p.y(), 2 * height_m - X.p.z()}};
}

}  // namespace

PlacedDistractor Distractor::At(double time_s) const {
  if (!span.Holds(time_s)) return {};
  PlacedDistractor placed{true, X_WV};
  placed.X_WV.p += v_W_mps * (time_s - span.begin_s);
  if (wrap_m > 0) {
    const double over_m = placed.X_WV.p.z() - wrap_top_m;
    if (over_m > 0) placed.X_WV.p.z() -= wrap_m * std::ceil(over_m / wrap_m);
  }
  return placed;
}

std::vector<Distractor> DistractorsOf(const DistractorFaults& faults, const vehicle::Scene& scene,
                                      uint64_t key) {
  std::vector<Distractor> distractors;
  const Pose& X_WM = scene.X_WM;
  const auto in_world = [&](const Vector3d& p_MQ) -> Pose { return {X_WM.q, X_WM * p_MQ}; };
  for (const ScreenFault& screen : faults.screens)
    distractors.push_back({.name = "screen",
                           .span = screen,
                           .ball = false,
                           .half_size_m = screen.size_m / 2,
                           .albedo = screen.albedo,
                           .shines_as = "",
                           .X_WV = in_world(screen.p_MQ_m)});
  for (const FishFault& fish : faults.fish)
    distractors.push_back({.name = "fish",
                           .span = fish,
                           .ball = true,
                           .half_size_m = Vector3d::Constant(fish.radius_m),
                           .albedo = fish.albedo,
                           .shines_as = fish.shines_as,
                           .X_WV = in_world(fish.p_MQ_m),
                           .v_W_mps = X_WM.q * fish.velocity_mps});
  for (const SecondMarkerFault& second : faults.second_markers)
    for (Distractor& part : CopyOfMarker(scene, "second_marker", second)) {
      part.X_WV.p += X_WM.q * second.p_MQ_m;
      distractors.push_back(part);
    }
  for (const MirrorFault& mirror : faults.mirrors)
    for (Distractor& part : CopyOfMarker(scene, "mirror_image", mirror)) {
      part.X_WV = Reflected(part.X_WV, X_WM.p.z() + mirror.surface_above_m);
      distractors.push_back(part);
    }
  Rng rng(key, 0);
  for (const BubblesFault& column : faults.bubbles)
    for (int i = 0; i < column.count; ++i) {
      const double x = rng.Uniform(-0.5, 0.5), y = rng.Uniform(-0.5, 0.5);
      const Vector3d share(x, y, rng.Uniform(-0.5, 0.5));
      distractors.push_back({.name = "bubble",
                             .span = column,
                             .ball = true,
                             .half_size_m = Vector3d::Constant(column.radius_m),
                             .albedo = Vector3d::Constant(column.albedo),
                             .shines_as = "",
                             .X_WV = in_world(column.p_MQ_m + column.size_m.cwiseProduct(share)),
                             .v_W_mps = {0, 0, column.rise_mps},
                             .wrap_m = column.size_m.z(),
                             .wrap_top_m = (X_WM * column.p_MQ_m).z() + column.size_m.z() / 2});
    }
  return distractors;
}

}  // namespace turbidock::view
