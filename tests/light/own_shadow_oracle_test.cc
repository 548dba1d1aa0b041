// Shadows of the vehicle's own parts, and lamps that are moved and turned.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sim/base/check.h"
#include "sim/light/own_shadow.h"
#include "sim/light/point_batch.h"
#include "sim/light/scattering.h"
#include "sim/light/water.h"
#include "tests/light/optics_scene.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::light {
namespace {

using Eigen::Vector3d;
using testing::Block;

Surface OwnPart(const Vector3d& p_HS, const Vector3d& half_m) {
  Surface part =
      Block("hull_panel", Pose{Eigen::Quaterniond::Identity(), p_HS}, half_m, 0.5, false);
  part.fixed_to = FixedTo::kVehicle;
  part.shades_lamps = true;
  return part;
}

// A plate 7 cm before a lamp covers all that is left of it, wherever the beam is aimed: straight
// ahead half of the lens is seen past its edge, and 30 mm more or less decide.
TEST(OwnShadow, OfAPlateEndsAtItsEdge) {
  for (const double toe_rad : {0.0, 0.4}) {
    const Pose X_HE{FromYawPitchRoll(toe_rad, 0, 0), {-0.1, 0.1, 0}};
    const OwnShadow shadow({OwnPart(X_HE.p + Vector3d(0.075, 0.5, 0), {0.005, 0.5, 0.5})}, X_HE,
                           RigParams{}.MakeRig());
    ASSERT_TRUE(shadow.any());
    const auto open = [&](double aside_m) {
      return shadow.OpenAt(Vector3d(0.07, aside_m, 0).normalized());
    };
    EXPECT_EQ(open(-0.03), 1);
    EXPECT_EQ(open(0.03), 0);
    EXPECT_NEAR(open(0), 0.5, 0.25);
    for (double aside_m = -0.03; aside_m < 0.03; aside_m += 0.002)
      EXPECT_GE(open(aside_m), open(aside_m + 0.002));
  }
}

TEST(OwnShadow, LeavesOutWhatTheCamerasDoNotSee) {
  const StereoRig rig = RigParams{}.MakeRig();
  const Pose X_HE = Pose::Translation(0, 0.16, 0);
  const Vector3d half_m(0.01, 0.01, 0.01);
  EXPECT_FALSE(OwnShadow({OwnPart(X_HE.p - Vector3d(0.05, 0, 0), half_m)}, X_HE, rig).any());
  EXPECT_FALSE(OwnShadow({OwnPart(X_HE.p + Vector3d(0, 0.1, 0), half_m)}, X_HE, rig).any());
  EXPECT_TRUE(OwnShadow({OwnPart(X_HE.p + Vector3d(0.05, 0, 0), half_m)}, X_HE, rig).any());
}

// As the scenes have them, nothing stands before the lamps; moved back by 10 cm, the front does.
TEST(OwnShadow, OfTheVehicles) {
  for (const char* name : {"pool_passive", "sea_passive"}) {
    const vehicle::Scene scene = vehicle::LoadScene({testing::ModelPath(name)}, {});
    const SurfaceTable surfaces = SurfaceTable::FromScene(scene);
    for (const Pose& X_HE : LampPoses(scene))
      for (const double back_m : {0.0, 0.1}) {
        const Pose X = PlaceLamp(X_HE, {.shift_m = {-back_m, 0, 0}});
        const OwnShadow shadow(PartsBefore(surfaces, X_HE, X), X, scene.rig);
        EXPECT_EQ(shadow.any(), back_m > 0);
        EXPECT_EQ(shadow.OpenAt(Vector3d::UnitX()), 1);
        // the panel reaches 0.105 m aside, 0.06 m and more before the lamp that stands 0.16 m aside
        const Vector3d inwards(0, X_HE.p.y() > 0 ? -1 : 1, 0);
        const double open = shadow.OpenAt((0.07 * Vector3d::UnitX() + 0.1 * inwards).normalized());
        EXPECT_EQ(open, back_m > 0 ? 0 : 1);
      }
  }
}

TEST(PlaceLamp, IsAMirrorImageOfTheOther) {
  LampParams params;
  params.shift_m = {-0.1, 0.02, 0.03};
  params.toe_in_rad = 0.2;
  params.tilt_rad = 0.1;
  const Pose left = PlaceLamp(Pose::Translation(0, 0.16, 0), params);
  const Pose right = PlaceLamp(Pose::Translation(0, -0.16, 0), params);
  const Vector3d mirror(1, -1, 1);
  EXPECT_TRUE(left.p.isApprox(Vector3d(-0.1, 0.18, 0.03)));
  EXPECT_TRUE(right.p.isApprox(left.p.cwiseProduct(mirror)));
  const Vector3d axis = left.q * Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(-axis.y(), axis.x()), 0.2, 1e-12);
  EXPECT_NEAR(std::asin(axis.z()), 0.1, 1e-12);
  EXPECT_TRUE((right.q * Vector3d::UnitX()).isApprox(axis.cwiseProduct(mirror)));
}

TEST(PlaceLamp, NotIntoTheHull) {
  const vehicle::Scene scene = vehicle::LoadScene({testing::ModelPath("pool_passive")}, {});
  const SurfaceTable surfaces = SurfaceTable::FromScene(scene);
  const Pose X_HE = LampPoses(scene)[0];
  const Pose X = PlaceLamp(X_HE, {.shift_m = {-0.03, -0.08, -0.01}});
  try {
    PartsBefore(surfaces, X_HE, X);
    ADD_FAILURE();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), ::testing::AllOf(::testing::HasSubstr("lights.lamps.shift_m"),
                                               ::testing::HasSubstr("hull_box")));
  }
}

// A plate 1 m ahead: in clear water what lies behind an own part is dark and the rest as without
// it; in turbid water the veil misses what is shaded.
TEST(OwnShadow, FallsOnSurfacesAndOnTheVeil) {
  const StereoRig rig = RigParams{}.MakeRig();
  OpticsParams params;
  params.ball_lights.enabled = false;
  params.lamps.enabled = true;
  params.shading.tile_px = 1;
  const Pose X_HE = Pose::Translation(-0.1, 0.16, 0);
  const std::vector<Surface> plate = {
      Block("plate", Pose::Translation(1.01, 0, 0), {0.01, 2, 2}, 0.6, false)};
  // 7 cm before the lamp, covers what is more than 2 cm to its right
  const std::vector<Surface> shaded = {plate[0], OwnPart({-0.03, -0.36, 0}, {0.002, 0.5, 0.5})};
  const auto green_at = [&](int column, const std::vector<Surface>& surfaces) {
    RadianceStereo out;
    Water(params, rig, SurfaceTable(surfaces), {X_HE}).Apply(testing::Cast(plate, rig), &out);
    return out.left.at(column, 240)[1];
  };
  constexpr int kLeft_px = 20, kRight_px = 620;
  EXPECT_GT(green_at(kLeft_px, plate), 0);
  EXPECT_EQ(green_at(kLeft_px, shaded), green_at(kLeft_px, plate));
  EXPECT_GT(green_at(kRight_px, plate), 0);
  EXPECT_EQ(green_at(kRight_px, shaded), 0);
  params.water.milk_ml_m3 = 20;
  EXPECT_GT(green_at(kLeft_px, shaded), 0);
  EXPECT_LT(green_at(kLeft_px, shaded), green_at(kLeft_px, plate));
}

// A plate that covers a corner of a turned lamp's beam, on points in all directions: a batch is lit
// as its points are one by one.
TEST(OwnShadow, OfABatchIsThatOfEachPoint) {
  const Pose X_HE{FromYawPitchRoll(0.2, 0.1, 0), {-0.1, 0.16, 0}};
  Lamp lamp;
  lamp.p_HE = X_HE.p;
  lamp.axis_H = X_HE.R().col(0);
  lamp.beam.intensity_w_sr = Vector3d::Ones();
  lamp.beam.cosine_exponent = 3;
  lamp.shadow = OwnShadow({OwnPart(X_HE.p + Vector3d(0.075, 0.5, 0.5), {0.005, 0.5, 0.5})}, X_HE,
                          RigParams{}.MakeRig());
  ASSERT_TRUE(lamp.shadow.any());
  PointBatch batch;
  batch.count = PointBatch::kSize;
  const auto p_EQ_H = [](int i) {
    return Vector3d(1, -0.7 + 0.2 * (i % 8), -0.75 + 0.1 * (i / 8));
  };
  for (int i = 0; i < batch.count; ++i) {
    const Eigen::Vector3f p_HQ = (X_HE.p + p_EQ_H(i)).cast<float>();
    batch.x_m[i] = p_HQ.x(), batch.y_m[i] = p_HQ.y(), batch.z_m[i] = p_HQ.z();
    batch.normal_x[i] = -1, batch.normal_y[i] = batch.normal_z[i] = 0;
    batch.red[i] = batch.green[i] = batch.blue[i] = 0;
    batch.visible[i] = 1;
  }
  AddLampIrradiance(lamp, Eigen::Array3f::Zero(), &batch);
  int dark = 0;
  for (int i = 0; i < batch.count; ++i) {
    const Vector3d d = p_EQ_H(i);
    EXPECT_NEAR(batch.green[i], BeamPattern(lamp, d.normalized()) * d.x() / std::pow(d.norm(), 3),
                3e-4)
        << d.transpose();
    dark += batch.green[i] == 0;
  }
  EXPECT_GT(dark, 16);
  EXPECT_LT(dark, 64);
}

}  // namespace
}  // namespace turbidock::light
