// What comes into view: when and where it is, and that the renderer shows it there.

#include "sim/view/distractors.h"

#include <gtest/gtest.h>

#include <set>

#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::view {
namespace {

using Eigen::Vector3d;
using testing::PosedScene;

TEST(Distractor, IsThereWhileItsFaultLastsAndMovesEvenly) {
  Distractor fish;
  fish.span.begin_s = 2;
  fish.span.end_s = 6;
  fish.X_WV.p = {1, 0, 0};
  fish.v_W_mps = {0, -0.5, 0.25};
  EXPECT_FALSE(fish.At(1.9).present);
  EXPECT_FALSE(fish.At(6).present);
  ASSERT_TRUE(fish.At(4).present);
  EXPECT_EQ(fish.At(4).X_WV.p, Vector3d(1, -1, 0.5));
}

TEST(Distractor, RisesAnewFromBelow) {
  Distractor bubble;
  bubble.X_WV.p = {0, 0, -0.2};
  bubble.v_W_mps = {0, 0, 0.1};
  bubble.wrap_m = 0.6;
  bubble.wrap_top_m = 0.3;
  EXPECT_NEAR(bubble.At(4.9).X_WV.p.z(), 0.29, 1e-9);
  EXPECT_NEAR(bubble.At(5.1).X_WV.p.z(), -0.29, 1e-9);
  EXPECT_NEAR(bubble.At(11.1).X_WV.p.z(), -0.29, 1e-9);
  for (double t = 0; t < 50; t += 0.37) EXPECT_LE(std::abs(bubble.At(t).X_WV.p.z()), 0.3 + 1e-9);
}

TEST(DistractorsOf, CopiesAndMirrorsTheMarker) {
  const PosedScene posed("sea_active");
  DistractorFaults faults;
  faults.second_markers.emplace_back().p_MQ_m = {0, 0.35, 0.1};
  faults.mirrors.emplace_back().surface_above_m = 0.25;
  const std::vector<Distractor> distractors = DistractorsOf(faults, posed.scene, 1);
  ASSERT_EQ(distractors.size(), 8U);  // a box and three balls each
  int compared = 0;
  for (size_t i = 0; i < distractors.size(); ++i)
    for (const vehicle::BallInScene& ball : posed.scene.balls) {
      if (distractors[i].shines_as != ball.name) continue;
      ++compared;
      EXPECT_EQ(distractors[i].half_size_m.x(), ball.radius_m);
      const Vector3d p_MQ = posed.scene.X_WM.Inverse() * distractors[i].X_WV.p;
      const Vector3d expected = i < 4 ? Vector3d(ball.p_MQ + Vector3d(0, 0.35, 0.1))
                                      : Vector3d(ball.p_MQ.x(), ball.p_MQ.y(), 0.5 - ball.p_MQ.z());
      EXPECT_LT((p_MQ - expected).norm(), 1e-9) << i << " " << ball.name;
    }
  EXPECT_EQ(compared, 6);
}

TEST(DistractorsOf, BubblesFillTheirColumn) {
  const PosedScene posed("sea_active");
  DistractorFaults faults;
  BubblesFault& column = faults.bubbles.emplace_back();
  column.count = 200;
  const auto distractors = DistractorsOf(faults, posed.scene, 7);
  ASSERT_EQ(distractors.size(), 200U);
  std::set<double> heights;
  for (const Distractor& bubble : distractors) {
    for (const double time_s : {0.0, 3.3, 40.0}) {
      const Vector3d p = posed.scene.X_WM.Inverse() * bubble.At(time_s).X_WV.p - column.p_MQ_m;
      EXPECT_LE((p.cwiseAbs() - column.size_m / 2).maxCoeff(), 1e-9);
    }
    heights.insert(bubble.X_WV.p.z());
  }
  EXPECT_EQ(heights.size(), 200U);
  EXPECT_NE(DistractorsOf(faults, posed.scene, 8)[0].X_WV.p, distractors[0].X_WV.p);
}

TEST(StereoRenderer, ShowsVisitorsWhereTheyAre) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("sea_active");
  posed.Place(Pose::Translation(0.8, 0, 0));
  DistractorFaults faults;
  faults.screens.emplace_back();  // right of the marker's middle
  faults.fish.emplace_back().p_MQ_m = {-0.25, 0.1, 0.05};
  const std::vector<Distractor> distractors = DistractorsOf(faults, posed.scene, 1);
  StereoRenderer renderer(*gl, posed.scene, distractors);
  RenderedStereo without, with;
  renderer.Render(*posed.data, &without);
  EXPECT_TRUE(without.distractors.empty());
  renderer.Place({distractors[0].At(0), distractors[1].At(0)});
  renderer.Render(*posed.data, &with);
  ASSERT_EQ(with.distractors.size(), 2U);

  const int screen = posed.scene.model->ngeom + 1, fish = screen + 1;
  for (const Side side : kSides) {
    const MountedCamera& camera = posed.scene.rig[side];
    const auto shown = [&](const RenderedStereo& seen, const Vector3d& p_MQ) {
      const Eigen::Vector2d px =
          camera.Project(camera.X_HC.Inverse() * (Vector3d(0.8, 0, 0) + p_MQ));
      return int{*seen[side].surface.at(static_cast<int>(std::lround(px.x())),
                                        static_cast<int>(std::lround(px.y())))};
    };
    const Vector3d blue(0, -0.09, 0), red(0, 0.018, 0.07), at_fish(-0.25, 0.1, 0.05);
    EXPECT_EQ(shown(without, blue), posed.Geom("ball_blue") + 1);
    EXPECT_EQ(shown(with, blue), screen);
    EXPECT_EQ(shown(with, at_fish), fish);
    EXPECT_NE(shown(without, at_fish), fish);
    EXPECT_EQ(shown(without, red), shown(with, red));
  }

  // Absent again, and the same in a region as in the whole.
  const StereoRegion region = {{300, 150, 500, 330}, {100, 100, 400, 300}};
  RenderedStereo part;
  renderer.Render(*posed.data, region, &part);
  int compared = 0;
  for (const Side side : kSides)
    for (int v = region[side].row_begin; v < region[side].row_end; ++v)
      for (int u = region[side].column_begin; u < region[side].column_end; ++u) {
        ASSERT_EQ(*part[side].surface.at(u, v), *with[side].surface.at(u, v));
        ASSERT_EQ(*part[side].depth_m.at(u, v), *with[side].depth_m.at(u, v));
        ++compared;
      }
  EXPECT_EQ(compared, 200 * 180 + 300 * 200);
  renderer.Place({{}, {}});
  RenderedStereo again;
  renderer.Render(*posed.data, &again);
  EXPECT_EQ(again.left.surface, without.left.surface);
}

}  // namespace
}  // namespace turbidock::view
