// Drawing depends on the state only: not on what was drawn before, with which context or beside
// whom.

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::view {
namespace {

using testing::PosedScene;

const Pose kSomeX_HM{FromYawPitchRoll(0.1, -0.05, 0.02), {0.7, 0.05, -0.03}};

RenderedStereo RenderAfresh() {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("pool_active");
  posed.Place(kSomeX_HM);
  StereoRenderer renderer(*gl, posed.scene);
  RenderedStereo rendered;
  renderer.Render(*posed.data, &rendered);
  return rendered;
}

void ExpectSame(const RenderedStereo& a, const RenderedStereo& b) {
  EXPECT_TRUE(a.left.surface == b.left.surface);
  EXPECT_TRUE(a.right.surface == b.right.surface);
  EXPECT_TRUE(a.left.depth_m == b.left.depth_m);
  EXPECT_TRUE(a.right.depth_m == b.right.depth_m);
}

TEST(RendererRepeats, InANewContext) {
  const RenderedStereo first = RenderAfresh();
  EXPECT_FALSE(first.left.surface == first.right.surface);
  ExpectSame(first, RenderAfresh());
}

TEST(RendererRepeats, InAnotherThread) {
  RenderedStereo other;
  std::thread([&] { other = RenderAfresh(); }).join();
  ExpectSame(RenderAfresh(), other);
}

TEST(RendererRepeats, WithTheSpectatorInBetween) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("pool_active");
  StereoRenderer renderer(*gl, posed.scene);
  SpectatorRenderer spectator(*gl, posed.scene, 320, 240);
  RenderedStereo rendered;
  Image3u8 picture, again;

  posed.Place(Pose::Translation(1.2, 0.2, 0));
  renderer.Render(*posed.data, &rendered);
  spectator.Render(*posed.data, posed.scene.spectator_camera, &picture);
  const RenderedStereo elsewhere = rendered;
  const uint16_t* memory = rendered.left.surface.data();

  posed.Place(kSomeX_HM);
  renderer.Render(*posed.data, &rendered);
  ExpectSame(rendered, RenderAfresh());
  EXPECT_FALSE(elsewhere.left.surface == rendered.left.surface);
  EXPECT_EQ(rendered.left.surface.data(), memory);

  posed.Place(Pose::Translation(1.2, 0.2, 0));
  spectator.Render(*posed.data, posed.scene.spectator_camera, &again);
  EXPECT_TRUE(picture == again);
}

// Rendering reads the state and leaves it as it is.
TEST(RendererRepeats, WithoutTouchingTheState) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("pool_active");
  posed.Place(kSomeX_HM);
  StereoRenderer renderer(*gl, posed.scene);
  const vehicle::MjDataPtr before(mj_copyData(nullptr, posed.scene.model.get(), posed.data.get()));
  RenderedStereo rendered;
  renderer.Render(*posed.data, &rendered);
  const mjModel& m = *posed.scene.model;
  EXPECT_TRUE(std::equal(before->qpos, before->qpos + m.nq, posed.data->qpos));
  EXPECT_TRUE(std::equal(before->qvel, before->qvel + m.nv, posed.data->qvel));
  EXPECT_TRUE(std::equal(before->cam_xpos, before->cam_xpos + 3 * m.ncam, posed.data->cam_xpos));
  EXPECT_TRUE(
      std::equal(before->geom_xpos, before->geom_xpos + 3 * m.ngeom, posed.data->geom_xpos));
  EXPECT_EQ(before->pstack, posed.data->pstack);
}

}  // namespace
}  // namespace turbidock::view
