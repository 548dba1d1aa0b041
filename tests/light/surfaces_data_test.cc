// The table of surfaces of the scenes in models/.
#include <gtest/gtest.h>

#include <string_view>

#include "sim/light/surfaces.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::light {
namespace {

TEST(SurfaceTable, OfTheScenes) {
  for (const char* name : {"pool_active", "pool_passive", "sea_active", "sea_passive"}) {
    const vehicle::Scene scene = vehicle::LoadScene({testing::ModelPath(name)}, {});
    const SurfaceTable table = SurfaceTable::FromScene(scene);
    ASSERT_EQ(table.size(), scene.model->ngeom);
    int casting = 0, own = 0;
    for (int geom = 0; geom < table.size(); ++geom) {
      const vehicle::Part part = scene.geom_part[geom];
      casting += table[geom].casts_shadow;
      own += table[geom].fixed_to == FixedTo::kVehicle;
      EXPECT_EQ(table[geom].fixed_to == FixedTo::kVehicle,
                part == vehicle::Part::kHull || part == vehicle::Part::kPole)
          << table[geom].name;
    }
    EXPECT_EQ(casting, 4) << name;  // box and three balls
    EXPECT_GT(own, 0);
    const double box = std::string_view(name).ends_with("passive") ? 0.7 : 0.5;
    EXPECT_TRUE(
        table[table.Find("marker_box")].albedo.isApprox(Eigen::Vector3d::Constant(box), 1e-6));
    for (const vehicle::BallInScene& ball : scene.balls) {
      const Surface& surface = table[table.Find("ball_" + ball.name)];
      EXPECT_EQ(surface.shape, Shape::kSphere);
      EXPECT_EQ(surface.size_m[0], ball.radius_m);
      EXPECT_TRUE(surface.X_AS.p.isApprox(scene.X_WM * ball.p_MQ, 1e-9));
    }
    // the pole's tip is on the pole, in the head frame
    const Surface& pole = table[table.Find("pole")];
    const Eigen::Vector3d p_SQ = pole.X_AS.Inverse() * scene.p_HQ_pole_tip;
    EXPECT_LT(p_SQ.norm(), pole.size_m[0] + pole.size_m[1] + 0.05);
  }
}

TEST(LampPoses, AreSymmetricAndLookAhead) {
  const vehicle::Scene scene = vehicle::LoadScene({testing::ModelPath("pool_passive")}, {});
  const std::vector<Pose> X_HE = LampPoses(scene);
  ASSERT_EQ(X_HE.size(), 2u);
  EXPECT_NEAR(X_HE[0].p.y(), -X_HE[1].p.y(), 1e-9);
  EXPECT_GT(X_HE[0].p.y(), 0.05);
  for (const Pose& X : X_HE) EXPECT_GT((X.q * Eigen::Vector3d::UnitX()).x(), 0.9);
}

}  // namespace
}  // namespace turbidock::light
