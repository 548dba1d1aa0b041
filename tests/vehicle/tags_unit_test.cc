// Fiducial tags in a scene: where they are in the marker frame, and what is refused.

#include "sim/vehicle/tags.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "tests/support/message_of.h"

namespace turbidock::vehicle {
namespace {

using ::testing::HasSubstr;

// The least that is a scene, with these sites in a body of the moored body.
Scene SceneWith(const std::string& sites) {
  const std::string path = ::testing::TempDir() + "tags_unit_test.xml";
  std::ofstream(path) << R"(<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <camera name="spectator" pos="0 0 1"/>
    <body name="vehicle" pos="-2 0 1">
      <freejoint/>
      <geom name="hull_box" type="box" size="0.1 0.1 0.1"/>
      <geom name="pole" type="capsule" size="0.01" fromto="0 0 0 0.3 0 0"/>
      <site name="camera_head"/> <site name="lamp_left"/> <site name="lamp_right"/>
      <site name="pole_tip"/> <site name="push"/>
      <camera name="left"/> <camera name="right"/>
    </body>
    <body name="moored_body" pos="1 2 3" euler="0 0 0.5">
      <body name="marker" pos="0 0 0.5">
        <site name="marker"/> <geom name="ball_pink" type="sphere" size="0.03"/>
      </body>
      <body name="station">
        <geom name="dock_block" type="box" size="0.1 0.1 0.1"/>
        <site name="dock_mouth"/>
        <site name="dock_throat" pos="0.2 0 0" type="box" size="0.01 0.05 0.05"/>
      </body>
      <body name="tags">)"
                      << sites << R"(</body>
    </body>
    <body name="loose"><joint/><geom name="x" type="sphere" size="0.1"/>)"
                      << (sites.empty() ? R"(<site name="tag_4" type="box" size="1 1 1"/>)" : "")
                      << R"(</body>
  </worldbody>
  <actuator><motor name="push" site="push" gear="1 0 0 0 0 0"/></actuator>
</mujoco>)";
  Scene scene = LoadScene({path}, RigParams{});
  std::filesystem::remove(path);
  return scene;
}

TEST(TagsOf, AreInTheMarkersFrameInTheOrderOfTheirNumbers) {
  const std::vector<TagInScene> tags = TagsOf(SceneWith(
      R"(<site name="tag_12" type="box" size="0.001 0.04 0.04" pos="0.1 0.2 0.3"/>
         <site name="tag_3" type="box" size="0.001 0.02 0.02" pos="0 0 0" euler="0.25 0 0"/>)"));
  ASSERT_EQ(tags.size(), 2u);
  EXPECT_EQ(tags[0].id, 3);
  EXPECT_EQ(tags[1].id, 12);
  EXPECT_NEAR(tags[0].size_m, 0.04, 1e-12);
  EXPECT_NEAR(tags[1].size_m, 0.08, 1e-12);
  // the marker's origin is half a metre above the moored body's
  EXPECT_LT((tags[1].X_MT.p - Eigen::Vector3d(0.1, 0.2, -0.2)).norm(), 1e-12);
  EXPECT_LT(AngleBetween(tags[1].X_MT.q, Eigen::Quaterniond::Identity()), 1e-7);
  EXPECT_LT(AngleBetween(tags[0].X_MT.q,
                         Eigen::Quaterniond(Eigen::AngleAxisd(0.25, Eigen::Vector3d::UnitX()))),
            1e-7);
}

TEST(TagsOf, RefusesWithTheSitesName) {
  const auto message = [](const std::string& sites) {
    return testing::MessageOf([&] { TagsOf(SceneWith(sites)); });
  };
  EXPECT_THAT(message(R"(<site name="tag_left" type="box" size="0.001 0.04 0.04"/>)"),
              HasSubstr("site \"tag_left\": must be named by its number"));
  EXPECT_THAT(message(R"(<site name="tag_1" type="box" size="0.001 0.04 0.05"/>)"),
              HasSubstr("site \"tag_1\": must be a box as wide as it is high"));
  EXPECT_THAT(message(R"(<site name="tag_1"/>)"), HasSubstr("must be a box"));
  EXPECT_THAT(message(R"(<site name="tag_1" type="box" size="0.001 0.04 0.04"/>
                         <site name="tag_01" type="box" size="0.001 0.04 0.04"/>)"),
              HasSubstr("site \"tag_01\": is a second tag of this number"));
  EXPECT_THAT(message(""), HasSubstr("site \"tag_4\": must be fixed to the marker"));
}

}  // namespace
}  // namespace turbidock::vehicle
