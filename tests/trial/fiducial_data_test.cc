// The bundled tags: what stands in the MJCF is the family's code, and it is in sight where it must
// be; the estimator finds the marker by it in the simulated cameras' images.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "experiments/config/data_files.h"
#include "experiments/trial/fixed_view.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/scene_marker.h"
#include "sim/vehicle/scene.h"
#include "sim/vehicle/tags.h"
#include "vision/fiducial_estimator.h"
#include "vision/tag_codes.h"

namespace turbidock::trial {
namespace {

const vision::FiducialParams& FiducialOf(const Scenario& scenario) {
  return scenario.plugins.ParamsOf<vision::FiducialParams>();
}

constexpr int kAcross = 8;  // cells, a white border of one included

class Tags : public ::testing::TestWithParam<const char*> {
 protected:
  Tags()
      : scenario_(LoadScenario(GetParam(), {})),
        scene_(vehicle::LoadScene(SceneFilesOf(scenario_), scenario_.rig)),
        data_(mj_makeData(scene_.model.get())) {
    mj_forward(scene_.model.get(), data_.get());
  }

  // What the camera head at a pose in M sees first along a line to a point in M: a geom's id.
  int SeenFrom(const Eigen::Vector3d& p_MC, const Eigen::Vector3d& p_MQ) const {
    const Eigen::Vector3d p_W = scene_.X_WM * p_MC, way_W = scene_.X_WM * p_MQ - p_W;
    int geom = -1;
    // nothing but what is drawn (group 3 is not), and without the vehicle
    const mjtByte groups[mjNGROUP] = {1, 1, 1, 0, 1, 1};
    mj_ray(scene_.model.get(), data_.get(), p_W.data(), way_W.data(), groups, /*flg_static=*/1,
           scene_.vehicle_body, &geom);
    return geom;
  }
  std::string NameOf(int geom) const {
    const char* name = geom < 0 ? nullptr : mj_id2name(scene_.model.get(), mjOBJ_GEOM, geom);
    return name ? name : "";
  }

  Scenario scenario_;
  vehicle::Scene scene_;
  vehicle::MjDataPtr data_;
};

TEST_P(Tags, StandInTheSceneAsTheFamilyHasThem) {
  const std::vector<vehicle::TagInScene> tags = vehicle::TagsOf(scene_);
  ASSERT_EQ(tags.size(), 2u);
  int compared = 0;
  for (const vehicle::TagInScene& tag : tags) {
    const vision::TagCells cells = vision::CellsOf(FiducialOf(scenario_).family, tag.id);
    ASSERT_EQ(cells.across, kAcross);
    const double cell_m = tag.size_m / (kAcross - 2);
    for (int row = 0; row < kAcross; ++row)
      for (int column = 0; column < kAcross; ++column) {
        const Eigen::Vector3d p_MQ =
            tag.X_MT * Eigen::Vector3d(0, (3.5 - column) * cell_m, (3.5 - row) * cell_m);
        const int geom = SeenFrom(p_MQ - Eigen::Vector3d(0.05, 0, 0), p_MQ);
        ASSERT_GE(geom, 0);
        const float albedo = scene_.model->geom_rgba[4 * geom];
        EXPECT_EQ(albedo > 0.5F, cells(row, column))
            << tag.id << ", row " << row << ", column " << column;
        ++compared;
      }
  }
  EXPECT_EQ(compared, 2 * kAcross * kAcross);
}

// Corners of the plates, and places along their edges.
TEST_P(Tags, AreWhollyInSightOfBothCamerasFromFarToTheFinalPose) {
  const StereoRig rig = scenario_.rig.MakeRig();
  // What is in the way of a plate; empty: nothing.
  const auto hidden_by = [&](const vehicle::TagInScene& tag, const Pose& X_MH) -> std::string {
    const double half_m = 0.65 * tag.size_m;  // with the border, but for its last millimetre
    for (const Side side : kSides) {
      const Pose X_MC = X_MH * rig[side].X_HC;
      for (int i = -4; i <= 4; ++i)
        for (int j = -4; j <= 4; ++j) {
          const Eigen::Vector3d p_MQ =
              tag.X_MT * Eigen::Vector3d(0, 0.25 * i * half_m, 0.25 * j * half_m);
          const Eigen::Vector2d pixel = rig[side].Project(X_MC.Inverse() * p_MQ);
          if (!(pixel.x() > 0 && pixel.x() < 639 && pixel.y() > 0 && pixel.y() < 479))
            return "the image's edge";
          const std::string seen = NameOf(SeenFrom(X_MC.p, p_MQ));
          if (!seen.starts_with("tag_")) return "'" + seen + "'";
        }
    }
    return "";
  };
  const std::vector<vehicle::TagInScene> tags = vehicle::TagsOf(scene_);
  for (double x_m = scenario_.procedure.docked_x_m; x_m <= 1.5; x_m += 0.05)
    for (const vehicle::TagInScene& tag : tags)
      EXPECT_EQ(hidden_by(tag, Pose::Translation(-x_m, 0, 0)), "") << tag.id << " at " << x_m;
  // at the edge of what counts as docked, one of them
  for (const double y_m : {-0.04, 0.04})
    for (const double z_m : {-0.04, 0.0, 0.04}) {
      const Pose X_MH = Pose::Translation(-scenario_.procedure.docked_x_m, y_m, z_m);
      const std::string left = hidden_by(tags[0], X_MH), right = hidden_by(tags[1], X_MH);
      EXPECT_TRUE(left.empty() || right.empty()) << left << ", " << right << " " << y_m;
    }
}

TEST_P(Tags, AreWhatTheEstimatorFindsTheMarkerBy) {
  // a particle that shines on a tag's edge spoils it for some frames
  scenario_.snow.particles_per_m3 = 0;
  std::vector<Pose> poses;
  for (const double x_m : {0.4, 0.6, 1.0})
    poses.push_back({FromYawPitchRoll(0.05, 0.02, -0.02), {x_m, 0.02, -0.01}});
  for (const FixedView& view : DrawFixedViews(scenario_, poses)) {
    camera::StereoCamera cameras = HoldView(view, scenario_, SeedTree(3));
    const auto estimator = scenario_.MakeEstimator("fiducial", SeedTree(4).Stream("none"));
    StereoImage seen;
    cameras.ExposeHeld(0, &seen);
    const PoseEstimate& estimate = estimator->Update(seen);
    ASSERT_TRUE(estimate.detected) << view.X_HM.p.x();
    EXPECT_LT((estimate.X_HM.p - view.X_HM.p).norm(), 0.015 * view.X_HM.p.x());
    EXPECT_LT(AngleBetween(estimate.X_HM.q, view.X_HM.q), 0.03);
  }
}

// Tags as `turbidock list --tags` draws them, in the place of the bundled ones.
TEST(DrawnTags, OfEachFamilyAreReadWithTheRightPose) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "drawn_tags";
  std::filesystem::create_directories(folder);
  std::ostringstream scene;
  scene << std::ifstream(config::ModelPath("sea_fiducial.xml")).rdbuf();
  std::string text = scene.str();
  const std::string bundled = "fiducial.xml\"";
  text.replace(text.find(bundled), bundled.size(), "my_tags.xml\"");
  std::ofstream(folder / "scene.xml") << text;
  for (const auto& [family, name] : EnumNames<vision::TagFamily>::kNames) {
    SCOPED_TRACE(name);
    vision::FiducialParams known{.family = family};
    // one of them turned by a quarter
    known.tags = {{.id = 7, .p_MT_m = {0.105, 0.155, -0.06}, .size_m = 0.07},
                  {.id = 28,
                   .p_MT_m = {0.105, -0.155, 0.08},
                   .q_MT_wxyz = {std::sqrt(0.5), std::sqrt(0.5), 0, 0}}};
    std::ofstream(folder / "my_tags.xml") << TagsMjcf(known);
    const Scenario scenario =
        LoadScenario("sea_night_fiducial", {"trial.scene=" + (folder / "scene.xml").string(),
                                            std::string("estimator.fiducial.family=") + name});
    const vision::FiducialParams& fiducial = FiducialOf(scenario);
    ASSERT_EQ(fiducial.tags.size(), 2u);
    EXPECT_LT((fiducial.tags[1].q_MT_wxyz - known.tags[1].q_MT_wxyz).norm(), 1e-6);
    EXPECT_EQ(fiducial.tags[0].p_MT_m, known.tags[0].p_MT_m);
    EXPECT_EQ(fiducial.tags[0].size_m, 0.07);
    EXPECT_NO_THROW(
        CheckMarker(scenario, vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig)));
    const Pose X_HM = {FromYawPitchRoll(0.05, 0.02, -0.02), {0.5, 0.02, -0.01}};
    for (const FixedView& view : DrawFixedViews(scenario, {X_HM})) {
      camera::StereoCamera cameras = HoldView(view, scenario, SeedTree(3));
      StereoImage seen;
      cameras.ExposeHeld(0, &seen);
      vision::FiducialEstimator estimator(fiducial, scenario.rig.MakeRig());
      const PoseEstimate& estimate = estimator.Update(seen);
      EXPECT_GE(estimator.readings().size(), 4u);  // noise is read, too, where codes are short
      ASSERT_TRUE(estimate.detected);
      EXPECT_LT((estimate.X_HM.p - X_HM.p).norm(), 0.005);
      EXPECT_LT(AngleBetween(estimate.X_HM.q, X_HM.q), 0.02);
    }
  }
  std::filesystem::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Bundled, Tags, ::testing::Values("sea_night_fiducial", "pool_fiducial"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace turbidock::trial
