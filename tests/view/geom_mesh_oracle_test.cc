// Triangles of each shape against its equations: corners on the surface, closed, facing outwards.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "sim/base/check.h"
#include "sim/vehicle/scene.h"
#include "sim/view/geom_mesh.h"

namespace turbidock::view {
namespace {

using Eigen::Vector3d;

vehicle::MjModelPtr ModelWith(const std::string& geom) {
  const std::string xml =
      "<mujoco><asset><mesh name='wedge' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/>"
      "<hfield name='hill' nrow='2' ncol='2' size='1 1 1 1'/></asset>"
      "<worldbody><geom " +
      geom + "/></worldbody></mujoco>";
  const auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
  mj_makeEmptyFileVFS(vfs.get(), "m.xml", static_cast<int>(xml.size()));
  std::copy(xml.begin(), xml.end(), static_cast<char*>(vfs->filedata[0]));
  std::array<char, 500> error{};
  vehicle::MjModelPtr model(mj_loadXML("m.xml", vfs.get(), error.data(), error.size()));
  mj_deleteVFS(vfs.get());
  EXPECT_NE(model, nullptr) << error.data();
  return model;
}

struct Solid {
  double volume_m3 = 0;
  Vector3d area_m2 = Vector3d::Zero();  // sum of the outward vector areas: 0 if closed
};

Solid Measure(const GeomMesh& mesh) {
  Solid solid;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d p = mesh.vertices_m[a], q = mesh.vertices_m[b], r = mesh.vertices_m[c];
    solid.volume_m3 += p.dot(q.cross(r)) / 6;
    solid.area_m2 += (q - p).cross(r - p) / 2;
  }
  return solid;
}

TEST(GeomMesh, EnclosesTheShapesVolume) {
  constexpr double kPi = std::numbers::pi;
  struct Case {
    const char* geom;
    double volume_m3, relative_tol;
  };
  // Facets lie inside: an inscribed 40-gon has 0.4 % less than its circle.
  for (const Case& c :
       {Case{"type='box' size='0.1 0.2 0.3'", 8 * 0.1 * 0.2 * 0.3, 1e-12},
        Case{"type='cylinder' size='0.1 0.3'", kPi * 0.01 * 0.6, 0.0045},
        Case{"type='capsule' size='0.1 0.3'", kPi * 0.01 * 0.6 + 4 * kPi / 3 * 0.001, 0.0065},
        Case{"type='ellipsoid' size='0.1 0.2 0.3'", 4 * kPi / 3 * 0.1 * 0.2 * 0.3, 0.012},
        Case{"type='mesh' mesh='wedge'", 1.0 / 6, 1e-6}}) {
    SCOPED_TRACE(c.geom);
    const Solid solid = Measure(MeshOf(*ModelWith(c.geom), 0));
    EXPECT_LE(solid.volume_m3, c.volume_m3 * (1 + 1e-6));
    EXPECT_GE(solid.volume_m3, c.volume_m3 * (1 - c.relative_tol));
    EXPECT_LT(solid.area_m2.norm(), 1e-6);
  }
}

TEST(GeomMesh, CornersLieOnTheSurface) {
  for (const Vector3d& p : MeshOf(*ModelWith("type='ellipsoid' size='0.1 0.2 0.3'"), 0).vertices_m)
    EXPECT_NEAR(p.cwiseQuotient(Vector3d(0.1, 0.2, 0.3)).norm(), 1, 1e-12);
  for (const Vector3d& p : MeshOf(*ModelWith("type='capsule' size='0.1 0.3'"), 0).vertices_m) {
    const Vector3d on_axis(0, 0, std::clamp(p.z(), -0.3, 0.3));
    EXPECT_NEAR((p - on_axis).norm(), 0.1, 1e-12);
  }
}

TEST(GeomMesh, PlaneFacesUpwardsAndEndsSomewhere) {
  const GeomMesh bounded = MeshOf(*ModelWith("type='plane' size='2 3 1'"), 0);
  EXPECT_NEAR((Measure(bounded).area_m2 - Vector3d(0, 0, 24)).norm(), 0, 1e-12);
  const vehicle::MjModelPtr endless = ModelWith("type='plane' size='0 0 1'");
  const double far_m = endless->vis.map.zfar * endless->stat.extent;
  EXPECT_NEAR(MeshOf(*endless, 0).vertices_m[0].cwiseAbs().x(), far_m, 1e-9);
}

TEST(GeomMesh, NamesWhatCannotBeDrawn) {
  const vehicle::MjModelPtr model = ModelWith("name='hill' type='hfield' hfield='hill'");
  try {
    MeshOf(*model, 0);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.key(), "geom hill");
    EXPECT_NE(error.problem().find("cannot be drawn"), std::string::npos);
  }
}

}  // namespace
}  // namespace turbidock::view
