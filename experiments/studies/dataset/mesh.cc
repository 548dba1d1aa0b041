#include "experiments/studies/dataset/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/system/output_path.h"
#include "sim/base/units.h"

namespace turbidock::dataset {
namespace {

using report::Json;

// The marker as triangles, in mm about its origin.
class Mesh {
 public:
  explicit Mesh(const vision::MarkerParams& marker) {
    if (marker.box_m.minCoeff() > 0) AddBox(units::MmFromM(1) * marker.box_m / 2);
    for (const vision::BallParams& ball : marker.balls) AddBall(ball);
  }

  // ASCII, as BOP's readers have it.
  std::string Ply() const {
    std::string text = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
        "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\n"
        "property list uchar int vertex_indices\nend_header\n",
        vertices_.size(), faces_.size());
    for (const Vertex& v : vertices_)
      text += fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {} {} {}\n", v.p.x(), v.p.y(),
                          v.p.z(), v.n.x(), v.n.y(), v.n.z(), v.color[0], v.color[1], v.color[2]);
    for (const auto& [a, b, c] : faces_) text += fmt::format("3 {} {} {}\n", a, b, c);
    return text;
  }

  // BOP: the least box along the axes, and the largest distance between two vertices.
  Json Info() const {
    Eigen::Vector3d low = vertices_[0].p, high = low;
    double diameter = 0;
    for (const Vertex& a : vertices_) {
      low = low.cwiseMin(a.p);
      high = high.cwiseMax(a.p);
      for (const Vertex& b : vertices_) diameter = std::max(diameter, (a.p - b.p).norm());
    }
    Json info = {{"diameter", diameter}};
    for (int i = 0; i < 3; ++i) {
      info[fmt::format("min_{}", "xyz"[i])] = low[i];
      info[fmt::format("size_{}", "xyz"[i])] = high[i] - low[i];
    }
    return info;
  }

 private:
  struct Vertex {
    Eigen::Vector3d p, n;
    std::array<int, 3> color;
  };

  void AddQuad(int a, int b, int c, int d) {
    faces_.push_back({a, b, c});
    faces_.push_back({a, c, d});
  }
  void AddBox(const Eigen::Vector3d& half) {
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0}) {
        const Eigen::Vector3d n = side * Eigen::Vector3d::Unit(axis),
                              e = Eigen::Vector3d::Unit((axis + 1) % 3), f = n.cross(e);
        const int at = static_cast<int>(vertices_.size());
        for (const auto& [s, t] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
          vertices_.push_back({half.cwiseProduct(n + s * e + t * f), n, {128, 128, 128}});
        AddQuad(at, at + 1, at + 2, at + 3);
      }
  }
  void AddBall(const vision::BallParams& ball) {
    constexpr int kRings = 12, kAround = 24;
    const int at = static_cast<int>(vertices_.size());
    std::array<int, 3> color{};
    for (size_t i = 0; i < 3; ++i)
      color[i] = static_cast<int>(std::lround(255 * ball.display_rgb[i]));
    for (int ring = 0; ring <= kRings; ++ring)
      for (int step = 0; step < kAround; ++step) {
        const double down = M_PI * ring / kRings, around = 2 * M_PI * step / kAround;
        const Eigen::Vector3d n(std::sin(down) * std::cos(around),
                                std::sin(down) * std::sin(around), std::cos(down));
        vertices_.push_back({units::MmFromM(1) * (ball.p_MQ_m + ball.radius_m * n), n, color});
      }
    for (int ring = 0; ring < kRings; ++ring)
      for (int step = 0; step < kAround; ++step) {
        const int here = at + ring * kAround + step,
                  next = at + ring * kAround + (step + 1) % kAround;
        AddQuad(here, here + kAround, next + kAround, next);
      }
  }

  std::vector<Vertex> vertices_;
  std::vector<std::array<int, 3>> faces_;
};

}  // namespace

void WriteModel(const vision::MarkerParams& marker, const std::filesystem::path& folder) {
  const Mesh mesh(marker);
  Json info = mesh.Info();
  info["balls"] = Json::array();
  for (const vision::BallParams& ball : marker.balls)
    info["balls"].push_back({{"name", ball.name},
                             {"center", Eigen::Vector3d(1000 * ball.p_MQ_m)},
                             {"radius", units::MmFromM(ball.radius_m)}});
  std::filesystem::create_directories(folder);
  system::WriteWhole(folder / fmt::format("obj_{:06}.ply", kMarkerId), mesh.Ply());
  system::WriteWhole(folder / "models_info.json",
                     report::JsonText({{std::to_string(kMarkerId), info}}));
}

}  // namespace turbidock::dataset
