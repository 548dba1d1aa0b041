// Every file in models/ loads, steps and has the geometry it states.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

#include "sim/base/frames.h"
#include "sim/base/units.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;
using testing::CastRay;
using testing::ModelPath;
using testing::PosedScene;

const Pose kFinalX_HM = Pose::Translation(0.35, 0, 0);
constexpr double kExact_m = 1e-9;

std::string ReadText(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(ModelFiles, EachIsASceneOrPartOfOne) {
  const std::filesystem::path folder = std::filesystem::path(ModelPath("sea_active")).parent_path();
  std::set<std::string> scenes, parts, all;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".xml") continue;
    const std::string name = entry.path().filename(), text = ReadText(entry.path());
    all.insert(name);
    if (text.find("<mujoco model=") != std::string::npos) scenes.insert(name);
    constexpr std::string_view kInclude = "<include file=\"";
    for (size_t at = text.find(kInclude); at != std::string::npos; at = text.find(kInclude, at)) {
      at += kInclude.size();
      parts.insert(text.substr(at, text.find('"', at) - at));
    }
  }
  EXPECT_EQ(scenes,
            (std::set<std::string>{"pool_active.xml", "pool_fiducial.xml", "pool_passive.xml",
                                   "sea_active.xml", "sea_fiducial.xml", "sea_moored_active.xml",
                                   "sea_passive.xml", "tank_active.xml", "tank_passive.xml"}));
  std::set<std::string> used = scenes;
  used.insert(parts.begin(), parts.end());
  used.insert("bluerov2_heavy.xml");  // to be taken for vehicle.xml
  EXPECT_EQ(used, all);
}

class EveryScene : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, EveryScene,
                         ::testing::Values("pool_active", "pool_passive", "sea_active",
                                           "sea_passive", "sea_moored_active"),
                         [](const auto& tested) { return tested.param; });

TEST_P(EveryScene, StepsWithoutWarnings) {
  PosedScene posed(GetParam());
  for (int i = 0; i < 200; ++i) mj_step(posed.scene.model.get(), posed.data.get());
  for (int i = 0; i < mjNWARNING; ++i) EXPECT_EQ(posed.data->warning[i].number, 0) << i;
  EXPECT_GT(posed.data->time, 0.4);
}

TEST_P(EveryScene, MarkerIsThePublishedOne) {
  const PosedScene posed(GetParam());
  ASSERT_EQ(posed.scene.balls.size(), 3u);
  const std::map<std::string, Vector3d> expected = {
      {"green", {-0.07, 0, 0}}, {"red", {0, 0, 0.07}}, {"blue", {0, -0.07, 0}}};
  for (const BallInScene& ball : posed.scene.balls) {
    EXPECT_NEAR((ball.p_MQ - expected.at(ball.name)).norm(), 0, kExact_m) << ball.name;
    EXPECT_EQ(ball.radius_m, 0.02);
    // Its colour is the one in its name.
    const float* rgba = posed.scene.model->geom_rgba + 4 * ball.geom;
    const size_t brightest = std::max_element(rgba, rgba + 3) - rgba;
    EXPECT_EQ(brightest, std::string("rgb").find(ball.name[0])) << ball.name;
  }
  EXPECT_LT(AngleBetween(posed.scene.X_WM.q, Eigen::Quaterniond::Identity()), kExact_m);
}

TEST_P(EveryScene, PoleAndDockMeetAtTheFinalPose) {
  PosedScene posed(GetParam());
  const Scene& scene = posed.scene;
  EXPECT_NEAR((scene.p_HQ_pole_tip - Vector3d(0.31, 0, -0.17)).norm(), 0, kExact_m);
  EXPECT_NEAR(scene.dock_throat_depth_m, 0.06, kExact_m);
  EXPECT_EQ(scene.dock_throat_half_width_m, 0.035);
  const Pose X_MD = scene.X_WM.Inverse() * scene.X_WD;
  EXPECT_NEAR((X_MD.p - Vector3d(-0.14, 0, -0.17)).norm(), 0, kExact_m);

  // 100 mm past the mouth, 40 mm inside the throat, touching nothing.
  posed.Place(kFinalX_HM);
  const Vector3d p_DQ = scene.X_WD.Inverse() * SitePose(*posed.data, scene.pole_tip_site).p;
  EXPECT_NEAR((p_DQ - Vector3d(0.1, 0, 0)).norm(), 0, kExact_m);
  EXPECT_EQ(posed.data->ncon, 0);

  // The site is the very end of the pole: it touches the plate 150 mm further on, not earlier.
  const double to_plate_m = 0.11 - (-0.04);
  posed.Place(Pose::Translation(0.35 - to_plate_m + 1e-4, 0, 0));
  EXPECT_EQ(posed.data->ncon, 0);
  posed.Place(Pose::Translation(0.35 - to_plate_m - 1e-4, 0, 0));
  ASSERT_GT(posed.data->ncon, 0);
}

TEST_P(EveryScene, LeadInCatchesThePoleWithinTheCriterion) {
  PosedScene posed(GetParam());
  const double at_mouth_m = 0.31 + 0.14, past_mouth_m = at_mouth_m - 0.01;  // x of M in H
  for (const double sign : {-1.0, 1.0}) {
    for (const Vector3d& axis : {Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
      // 44.5 mm aside the pole enters the mouth freely; at 60 mm it meets the lead-in.
      const Vector3d p_inside = Vector3d(at_mouth_m, 0, 0) + sign * 0.0445 * axis;
      posed.Place({Eigen::Quaterniond::Identity(), p_inside});
      EXPECT_EQ(posed.data->ncon, 0) << sign * axis.transpose();
      const Vector3d p_rim = Vector3d(past_mouth_m, 0, 0) + sign * 0.060 * axis;
      posed.Place({Eigen::Quaterniond::Identity(), p_rim});
      ASSERT_GT(posed.data->ncon, 0) << sign * axis.transpose();
      const mjContact& contact = posed.data->contact[0];
      const Part a = posed.scene.geom_part[contact.geom1], b = posed.scene.geom_part[contact.geom2];
      EXPECT_TRUE((a == Part::kPole && b == Part::kDock) || (a == Part::kDock && b == Part::kPole));
    }
  }
}

// Pushed gently from anywhere within the criterion, in a viscous fluid, the pole finds its way into
// the throat.
TEST(Dock, LeadsThePoleIn) {
  for (const double offset_m : {-0.038, 0.0, 0.038}) {
    PosedScene posed("sea_active");
    mjModel& m = *posed.scene.model;
    mju_zero3(m.opt.gravity);
    mjData& d = *posed.data;
    posed.Place({FromYawPitchRoll(0.05, 0, 0), {0.48, offset_m, offset_m}});
    for (int i = 0; i < 480 * 5; ++i) {
      d.ctrl[posed.scene.thrusters[0].actuator] = d.ctrl[posed.scene.thrusters[1].actuator] = 1;
      const Vector3d eps = BodyPose(d, posed.scene.vehicle_body).q.vec();
      for (int k = 0; k < 3; ++k) {
        d.qfrc_applied[k] = -20 * d.qvel[k];
        d.qfrc_applied[3 + k] = -0.5 * d.qvel[3 + k] - (k < 2 ? 8 * eps[k] : 0);
      }
      mj_step(&m, &d);
    }
    const Vector3d p_DQ = posed.scene.X_WD.Inverse() * SitePose(d, posed.scene.pole_tip_site).p;
    EXPECT_GT(p_DQ.x(), posed.scene.dock_throat_depth_m + 0.05) << offset_m;
    // The hole leaves 35 - 17.5 mm; a tilted pole's very end may be a little further aside.
    EXPECT_LT(p_DQ.tail<2>().cwiseAbs().maxCoeff(), 0.0205) << offset_m;
  }
}

// Seen from its axis, the funnel is closed all round, as wide as stated, and drawn where contacts
// feel it.
TEST_P(EveryScene, FunnelHasNoGaps) {
  PosedScene posed(GetParam());
  posed.Place(Pose::Translation(1.5, 0, 0));
  int checked = 0;
  for (double depth_m = 0.002; depth_m < 0.24; depth_m += 0.007) {
    const double half_m = depth_m < 0.06 ? 0.0625 - 0.0275 * depth_m / 0.06 : 0.035;
    const Vector3d p_WQ = posed.scene.X_WD * Vector3d(depth_m, 0, 0);
    for (int i = 0; i < 72; ++i) {
      const double angle_rad = 2 * std::numbers::pi * (i + 0.5) / 72;
      const Vector3d out(0, std::cos(angle_rad), std::sin(angle_rad));
      const double expected_m = half_m / std::max(std::abs(out.y()), std::abs(out.z()));
      const auto drawn = CastRay(posed, p_WQ, out);
      ASSERT_GE(drawn.geom, 0) << depth_m << " " << angle_rad;
      EXPECT_EQ(posed.scene.geom_part[drawn.geom], Part::kDock);
      EXPECT_NEAR(drawn.range_m, expected_m, 2e-5) << depth_m << " " << angle_rad;
      if (depth_m < 0.058) {
        const auto felt = CastRay(posed, p_WQ, out, /*contact_only=*/true);
        ASSERT_GE(felt.geom, 0) << depth_m << " " << angle_rad;
        EXPECT_NEAR(felt.range_m, expected_m, 2e-5) << depth_m << " " << angle_rad;
      }
      ++checked;
    }
  }
  EXPECT_EQ(checked, 34 * 72);
}

// Half extents of a geom along B's axes about its centre.
Vector3d HalfExtents(const mjModel& m, int geom, const Eigen::Matrix3d& R_BQ) {
  const Vector3d size = Eigen::Map<const Vector3d>(m.geom_size + 3 * geom);
  const Vector3d axis = R_BQ.col(2).cwiseAbs();
  switch (m.geom_type[geom]) {
    case mjGEOM_BOX:
      return R_BQ.cwiseAbs() * size;
    case mjGEOM_ELLIPSOID:
      return (R_BQ.cwiseAbs2() * size.cwiseAbs2()).cwiseSqrt();
    case mjGEOM_CAPSULE:
      return size[1] * axis + Vector3d::Constant(size[0]);
    case mjGEOM_CYLINDER:
      return size[1] * axis +
             size[0] * (Vector3d::Ones() - axis.cwiseAbs2()).cwiseMax(0).cwiseSqrt();
    default:
      ADD_FAILURE() << "geom type " << m.geom_type[geom];
      return Vector3d::Constant(1e9);
  }
}

TEST_P(EveryScene, HullFillsThePublishedSize) {
  const PosedScene posed(GetParam());
  const mjModel& m = *posed.scene.model;
  int hulls = 0, lamps = 0;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    if (posed.scene.geom_part[geom] != Part::kHull) continue;
    const mjtNum* q = m.geom_quat + 4 * geom;
    const Vector3d p_BQ = Eigen::Map<const Vector3d>(m.geom_pos + 3 * geom);
    const Vector3d reach =
        p_BQ.cwiseAbs() +
        HalfExtents(m, geom, Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix());
    // Only the lamps on their arms are wider.
    const bool lamp = posed.GeomName(geom).starts_with("hull_lamp_");
    const Vector3d limit(0.19, lamp ? 0.185 : 0.14, 0.155);
    EXPECT_TRUE((reach.array() <= limit.array() + kExact_m).all())
        << posed.GeomName(geom) << " reaches " << reach.transpose();
    ++hulls;
    lamps += lamp;
  }
  EXPECT_GT(hulls, 30);
  EXPECT_EQ(lamps, 5);
  const int box = posed.Geom("hull_box");
  ASSERT_GE(box, 0);
  EXPECT_EQ(Vector3d(Eigen::Map<const Vector3d>(m.geom_size + 3 * box)),
            Vector3d(0.19, 0.14, 0.155));
}

// With unit control each motor pushes with 1 N along its axis. It has no limits: those are the
// thruster's data.
TEST_P(EveryScene, ThrustersPushAsNamed) {
  PosedScene posed(GetParam());
  const Vector3d axes[] = {{1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const double yaw_arms_m[] = {-0.10, 0.10, 0, 0};
  for (int i = 0; i < 4; ++i) {
    const int actuator = posed.scene.thrusters[i].actuator;
    posed.Place(Pose::Translation(1.5, 0, 0));
    for (const double ctrl : {1.0, -1.0, 100.0, -100.0}) {
      mju_zero(posed.data->ctrl, posed.scene.model->nu);
      posed.data->ctrl[actuator] = ctrl;
      mj_forward(posed.scene.model.get(), posed.data.get());
      const Vector3d force = Eigen::Map<const Vector3d>(posed.data->qfrc_actuator);
      const Vector3d torque = Eigen::Map<const Vector3d>(posed.data->qfrc_actuator + 3);
      EXPECT_NEAR((force - ctrl * axes[i]).norm(), 0, kExact_m) << i;
      EXPECT_NEAR((torque - Vector3d(0, 0, ctrl * yaw_arms_m[i])).norm(), 0, kExact_m) << i;
    }
  }
}

TEST_P(EveryScene, CamerasStandWhereTheRigSays) {
  const RigParams params{
      .width_px = 800, .height_px = 500, .horizontal_fov_rad = 1.3, .baseline_m = 0.2};
  PosedScene posed(GetParam(), params);
  posed.Place({FromYawPitchRoll(0.3, -0.2, 0.1), {0.9, 0.1, -0.05}});
  const Pose X_WH = SitePose(*posed.data, posed.scene.camera_head_site);
  const StereoRig rig = params.MakeRig();
  const std::pair<int, Pose> cameras[] = {{posed.scene.left_camera, X_WH * rig.left.X_HC},
                                          {posed.scene.right_camera, X_WH * rig.right.X_HC}};
  for (const auto& [camera, X_WC] : cameras) {
    const Vector3d p_WG = Eigen::Map<const Vector3d>(posed.data->cam_xpos + 3 * camera);
    const Eigen::Matrix3d R_WG = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
        posed.data->cam_xmat + 9 * camera);
    EXPECT_NEAR((p_WG - X_WC.p).norm(), 0, kExact_m);
    EXPECT_NEAR((R_WG - X_WC.R() * OpticalFromMujocoCamera()).norm(), 0, kExact_m);
    // Half the image height at the distance of the focal length.
    EXPECT_NEAR(std::tan(units::RadFromDeg(posed.scene.model->cam_fovy[camera]) / 2),
                250 / rig.left.fy_px, 1e-12);
  }
  EXPECT_EQ(posed.scene.rig.left.width_px, 800);
}

}  // namespace
}  // namespace turbidock::vehicle
