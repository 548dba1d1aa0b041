#include "sim/view/surface_list.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace turbidock::view {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMargin_px = 1;  // more than what rounding moves

// Homogeneous pixels of a point in the optical frame are K p_CQ.
Matrix3d PixelFromOptical(const CameraIntrinsics& camera) {
  Matrix3d K;
  K << camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1;
  return K;
}

// The part of space in front of the near plane that a region of the image shows, in the optical
// frame: n . p >= offset for each side, n of length 1.
struct ViewVolume {
  ViewVolume(const CameraIntrinsics& camera, const PixelRegion& region, double near_m) {
    const Vector3d first =
        camera.RayAt(region.column_begin - 0.5 - kMargin_px, region.row_begin - 0.5 - kMargin_px);
    const Vector3d last =
        camera.RayAt(region.column_end - 0.5 + kMargin_px, region.row_end - 0.5 + kMargin_px);
    normals << 1, 0, -first.x(), -1, 0, last.x(), 0, 1, -first.y(), 0, -1, last.y(), 0, 0, 1;
    normals.rowwise().normalize();
    offsets << 0, 0, 0, 0, near_m;
  }
  bool MissesBall(const Vector3d& p_CQ, double radius_m) const {
    return ((normals * p_CQ - offsets).array() < -radius_m).any();
  }

  Eigen::Matrix<double, 5, 3> normals;
  Eigen::Vector<double, 5> offsets;
};

// Where a ball's outline begins and ends along one axis of the plane at depth 1, its centre being
// at h beside and z along the optical axis.
struct Extent {
  double low, high;
};
Extent OutlineOf(double h_m, double z_m, double radius_m) {
  if (z_m <= radius_m) return {-kInfinity, kInfinity};
  const double scale = 1 / (z_m * z_m - radius_m * radius_m);
  const double middle = h_m * z_m * scale;
  const double half = radius_m * std::sqrt(h_m * h_m + 1 / scale) * scale;
  return {middle - half, middle + half};
}

}  // namespace

SurfaceLister::SurfaceLister(const mjModel& model, const std::vector<Distractor>& distractors,
                             int hidden_group, float near_m)
    : near_m_(near_m) {
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_group[geom] == hidden_group || model.geom_rgba[4 * geom + 3] == 0) continue;
    const int type = model.geom_type[geom];
    const bool ball = type == mjGEOM_SPHERE;
    drawn_.push_back({geom, ball, type == mjGEOM_PLANE ? kInfinity : model.geom_rbound[geom],
                      ball ? GeomMesh{} : MeshOf(model, geom)});
  }
  for (const Distractor& distractor : distractors) {
    const Vector3d& half_m = distractor.half_size_m;
    distractors_.push_back({model.ngeom + static_cast<int>(distractors_.size()), distractor.ball,
                            distractor.ball ? half_m.x() : half_m.norm(),
                            distractor.ball ? GeomMesh{} : BoxMesh(half_m)});
  }
}

void SurfaceLister::List(const mjData& data, std::span<const PlacedDistractor> distractors,
                         const CameraIntrinsics& camera, const Pose& X_WC,
                         const PixelRegion& region, SurfaceList* list) const {
  list->corners.clear();
  list->triangles.clear();
  list->balls.clear();
  const Pose X_CW = X_WC.Inverse();
  const Matrix3d R_CW = X_CW.R(), K = PixelFromOptical(camera);
  const ViewVolume volume(camera, region, near_m_);

  // R_WG is asked for where it is needed only
  const auto add = [&](const Drawn& drawn, const Vector3d& p_WG, const auto& R_WG) {
    const auto surface = static_cast<uint16_t>(drawn.geom + 1);
    const Vector3d p_CG = X_CW * p_WG;
    if (volume.MissesBall(p_CG, drawn.bounding_radius_m)) return;

    if (drawn.ball) {
      const double radius_m = drawn.bounding_radius_m;
      // the pixels between two places along an axis of the picture
      const auto pixels = [](Extent extent, double f_px, double c_px,
                             int count) -> std::pair<int, int> {
        const auto whole = [&](double at) {
          return static_cast<int>(std::clamp(at * f_px + c_px, -1.0, static_cast<double>(count)));
        };
        return {std::max(whole(extent.low) - 1, 0), std::min(whole(extent.high) + 2, count)};
      };
      const auto [column_begin, column_end] = pixels(OutlineOf(p_CG.x(), p_CG.z(), radius_m),
                                                     camera.fx_px, camera.cx_px, camera.width_px);
      const auto [row_begin, row_end] = pixels(OutlineOf(p_CG.y(), p_CG.z(), radius_m),
                                               camera.fy_px, camera.cy_px, camera.height_px);
      list->balls.push_back({.p_CQ = p_CG.cast<float>(),
                             .radius_m = static_cast<float>(radius_m),
                             .surface = surface,
                             .bounds = {column_begin, row_begin, column_end, row_end},
                             .cx_px = static_cast<float>(camera.cx_px),
                             .cy_px = static_cast<float>(camera.cy_px),
                             .per_fx = static_cast<float>(1 / camera.fx_px),
                             .per_fy = static_cast<float>(1 / camera.fy_px)});
      return;
    }

    const Matrix3d R_CG = R_CW * R_WG();
    const auto beyond = [&](Eigen::Index side) {
      const Vector3d n_G = R_CG.transpose() * volume.normals.row(side).transpose();
      const double offset = volume.offsets[side] - volume.normals.row(side).dot(p_CG);
      return std::ranges::all_of(drawn.mesh.vertices_m,
                                 [&](const Vector3d& p_GQ) { return n_G.dot(p_GQ) < offset; });
    };
    bool outside = false;
    for (Eigen::Index side = 0; side < volume.offsets.size() && !outside; ++side)
      outside = beyond(side);
    if (outside) return;

    const Matrix3d KR = K * R_CG;
    const Vector3d Kp = K * p_CG;
    const uint32_t base = static_cast<uint32_t>(list->corners.size());
    for (const Vector3d& p_GQ : drawn.mesh.vertices_m) list->corners.emplace_back(KR * p_GQ + Kp);
    for (const auto& [i, j, k] : drawn.mesh.triangles)
      list->triangles.push_back({{base + i, base + j, base + k}, surface});
  };
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  for (const Drawn& drawn : drawn_)
    add(drawn, Vector3d::Map(data.geom_xpos + 3 * drawn.geom),
        [&]() -> Matrix3d { return RowMajor::Map(data.geom_xmat + 9 * drawn.geom); });
  for (size_t i = 0; i < std::min(distractors.size(), distractors_.size()); ++i)
    if (distractors[i].present)
      add(distractors_[i], distractors[i].X_WV.p,
          [&]() -> Matrix3d { return distractors[i].X_WV.R(); });
}

}  // namespace turbidock::view
