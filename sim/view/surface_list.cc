#include "sim/view/surface_list.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace turbidock::view {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMargin_px = 1;  // more than what rounding and OpenGL's snapping of corners move

// Clip coordinates (x, y, w) of a point in the optical frame are K p_CQ.
Matrix3d ClipFromOptical(const CameraIntrinsics& camera) {
  const double to_x = 2.0 / camera.width_px, to_y = 2.0 / camera.height_px;
  Matrix3d K;
  K << to_x * camera.fx_px, 0, to_x * (camera.cx_px + 0.5) - 1,  //
      0, to_y * camera.fy_px, to_y * (camera.cy_px + 0.5) - 1,   //
      0, 0, 1;
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

// What is listed of one picture.
class Listing {
 public:
  Listing(const CameraIntrinsics& camera, const PixelRegion& region, float near_m,
          SurfaceList* list)
      : camera_(camera),
        region_(region),
        near_m_(near_m),
        K_(ClipFromOptical(camera)),
        volume_(camera, region, near_m),
        list_(*list) {
    list_.corners.clear();
    list_.triangles.clear();
    list_.ball_corners.clear();
    list_.ball_triangles.clear();
    list_.drawn = {region.column_end, region.row_end, region.column_begin, region.row_begin};
    list_.planes.clear();
  }

  bool Misses(const Vector3d& p_CG, double radius_m) const {
    return volume_.MissesBall(p_CG, radius_m);
  }

  void AddBall(const Vector3d& p_CG, double radius_m, uint32_t surface) {
    const Vector3d first_ray = camera_.RayAt(-0.5, -0.5);
    const Vector3d last_ray = camera_.RayAt(camera_.width_px - 0.5, camera_.height_px - 0.5);
    const auto in_view = [](Extent extent, double margin, double first, double last) {
      return Extent{std::max(extent.low - margin, first), std::min(extent.high + margin, last)};
    };
    const Extent x = in_view(OutlineOf(p_CG.x(), p_CG.z(), radius_m), kMargin_px / camera_.fx_px,
                             first_ray.x(), last_ray.x());
    const Extent y = in_view(OutlineOf(p_CG.y(), p_CG.z(), radius_m), kMargin_px / camera_.fy_px,
                             first_ray.y(), last_ray.y());
    if (x.low >= x.high || y.low >= y.high) return;
    const uint32_t base = static_cast<uint32_t>(list_.ball_corners.size());
    const Eigen::Vector4f ball = (Eigen::Vector4d() << p_CG, radius_m).finished().cast<float>();
    for (const double ray_y : {y.low, y.high})
      for (const double ray_x : {x.low, x.high}) {
        const Vector3d clip = K_ * Vector3d(ray_x, ray_y, 1);
        list_.ball_corners.push_back({{static_cast<float>(clip.x()), static_cast<float>(clip.y())},
                                      {static_cast<float>(ray_x), static_cast<float>(ray_y)},
                                      {ball[0], ball[1], ball[2], ball[3]},
                                      surface});
        Cover(clip);
      }
    // As a facet's corners are seen from outside: y runs downwards.
    for (const uint32_t corner : {0, 2, 1, 1, 2, 3}) list_.ball_triangles.push_back(base + corner);
  }

  void AddFacets(const GeomMesh& mesh, const Matrix3d& R_CG, const Vector3d& p_CG,
                 uint32_t surface) {
    for (Eigen::Index side = 0; side < volume_.offsets.size(); ++side) {
      const Vector3d n_G = R_CG.transpose() * volume_.normals.row(side).transpose();
      const double offset = volume_.offsets[side] - volume_.normals.row(side).dot(p_CG);
      if (std::ranges::all_of(mesh.vertices_m,
                              [&](const Vector3d& p_GQ) { return n_G.dot(p_GQ) < offset; }))
        return;
    }
    const Matrix3d KR = K_ * R_CG;
    const Vector3d Kp = K_ * p_CG;
    const uint32_t base = static_cast<uint32_t>(list_.corners.size());
    for (const Vector3d& p_GQ : mesh.vertices_m) {
      const Vector3d corner = KR * p_GQ + Kp;
      const Eigen::Vector3f clip = corner.cast<float>();
      list_.corners.push_back({{clip.x(), clip.y(), near_m_, clip.z()}, surface});
      Cover(corner);
    }
    for (const auto& triangle : mesh.triangles)
      for (const uint32_t corner : triangle) list_.triangles.push_back(base + corner);
  }

  // `half_m` is its corner.
  void AddPlane(const Vector3d& half_m, const Matrix3d& R_CG, const Vector3d& p_CG,
                uint32_t surface) {
    const auto seen =
        PlaneSeen(camera_, R_CG, p_CG, half_m.head<2>(), near_m_, static_cast<uint16_t>(surface));
    if (seen) list_.planes.push_back(*seen);
  }

 private:
  // A corner of something drawn, in clip coordinates. One that is behind the near plane may leave
  // the picture anywhere.
  void Cover(const Vector3d& clip) {
    PixelRegion& drawn = list_.drawn;
    if (clip.z() < static_cast<double>(near_m_)) {
      drawn = region_;
      return;
    }
    const auto first_at = [](double ndc, int size_px) {
      const double edge = std::floor(0.5 * (ndc + 1) * size_px - kMargin_px);
      return static_cast<int>(std::clamp(edge, 0.0, static_cast<double>(size_px)));
    };
    const auto grow = [&](double ndc, int size_px, int low, int high, int* begin, int* end) {
      const int first = std::clamp(first_at(ndc, size_px), low, high);
      const int last = std::clamp(size_px - first_at(-ndc, size_px), low, high);
      *begin = std::min(*begin, first);
      *end = std::max(*end, last);
    };
    grow(clip.x() / clip.z(), camera_.width_px, region_.column_begin, region_.column_end,
         &drawn.column_begin, &drawn.column_end);
    grow(clip.y() / clip.z(), camera_.height_px, region_.row_begin, region_.row_end,
         &drawn.row_begin, &drawn.row_end);
  }

  const CameraIntrinsics& camera_;
  const PixelRegion& region_;
  float near_m_;
  Matrix3d K_;
  ViewVolume volume_;
  SurfaceList& list_;
};

}  // namespace

SurfaceLister::SurfaceLister(const mjModel& model, const std::vector<Distractor>& distractors,
                             int hidden_group, float near_m)
    : near_m_(near_m) {
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_group[geom] == hidden_group || model.geom_rgba[4 * geom + 3] == 0) continue;
    const int type = model.geom_type[geom];
    const bool ball = type == mjGEOM_SPHERE;
    const bool plane = type == mjGEOM_PLANE;
    drawn_.push_back({geom, ball, plane, plane ? kInfinity : model.geom_rbound[geom],
                      ball ? GeomMesh{} : MeshOf(model, geom)});
  }
  for (const Distractor& distractor : distractors) {
    const Vector3d& half_m = distractor.half_size_m;
    distractors_.push_back({model.ngeom + static_cast<int>(distractors_.size()), distractor.ball,
                            false, distractor.ball ? half_m.x() : half_m.norm(),
                            distractor.ball ? GeomMesh{} : BoxMesh(half_m)});
  }
}

void SurfaceLister::List(const mjData& data, std::span<const PlacedDistractor> distractors,
                         const CameraIntrinsics& camera, const Pose& X_WC,
                         const PixelRegion& region, SurfaceList* list) const {
  const Pose X_CW = X_WC.Inverse();
  const Matrix3d R_CW = X_CW.R();
  Listing listing(camera, region, near_m_, list);
  // R_WG is asked for where it is needed only
  const auto add = [&](const Drawn& drawn, const Vector3d& p_WG, const auto& R_WG) {
    const uint32_t surface = static_cast<uint32_t>(drawn.geom) + 1;
    const Vector3d p_CG = X_CW * p_WG;
    if (listing.Misses(p_CG, drawn.bounding_radius_m)) return;
    if (drawn.ball)
      listing.AddBall(p_CG, drawn.bounding_radius_m, surface);
    else if (drawn.plane)
      listing.AddPlane(drawn.mesh.vertices_m[2], R_CW * R_WG(), p_CG, surface);
    else
      listing.AddFacets(drawn.mesh, R_CW * R_WG(), p_CG, surface);
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
