// Images with ground truth: two ways to the same masks, what is there is kept, and nothing is
// mixed.

#include "experiments/studies/dataset/dataset.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "experiments/media/png.h"
#include "experiments/report/json.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/trial.h"
#include "sim/base/check.h"
#include "sim/base/units.h"
#include "tests/support/message_of.h"

namespace turbidock::dataset {
namespace {

namespace fs = std::filesystem;
using report::Json;

batch::Plan SmallPlan(int seeds) {
  return {"schema_version: 1\ndescription: near the marker\nscenario: pool_active\nseeds: " +
              std::to_string(seeds) +
              "\nset: {cameras.rig.width_px: 160, cameras.rig.height_px: 120, "
              "start.distance_min_m: 0.5, "
              "start.distance_max_m: 0.7, start.lateral_m: 0.02, start.vertical_m: 0.02, "
              "start.heading_rad: 0.05}\n",
          "plan"};
}

class Dataset : public ::testing::Test {
 protected:
  void SetUp() override { fs::remove_all(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  const fs::path folder_ =
      fs::temp_directory_path() / ("turbidock_dataset_" + std::to_string(getpid()));
};

TEST_F(Dataset, MasksByRaysAndByOpenGlAgreeWhereNothingHidesTheMarker) {
  const DatasetSummary made = MakeDataset(SmallPlan(2), folder_.string(), {.pairs_per_shard = 2});
  EXPECT_TRUE(made.complete);
  EXPECT_EQ(made.images, 4);
  const fs::path shard = folder_ / "train_pbr/000000";
  const std::string file = (shard / "scene_gt_info.json").string();
  const Json info = report::ParseJson(system::ReadWhole(file), file);
  ASSERT_EQ(info.size(), 4u);
  for (const auto& [id, objects] : info.items()) {
    const int64_t whole = objects[0]["px_count_all"], seen = objects[0]["px_count_visib"];
    EXPECT_GT(whole, 300) << id;
    EXPECT_NEAR(static_cast<double>(seen) / static_cast<double>(whole), 1, 0.02) << id;
    const Image3u8 image = media::ReadPng((shard / "rgb" / ("00000" + id + ".png")).string());
    EXPECT_EQ(image.width(), 160);
  }
  // the masks' tint makes the sheet greener than the images it is made of
  const Image3u8 sheet = media::ReadPng((folder_ / "contact_sheet.png").string());
  EXPECT_EQ(sheet.width(), 4 * 320);
  int tinted = 0;
  for (size_t i = 0; i < sheet.pixels(); ++i) {
    const uint8_t* p = sheet.data() + 3 * i;
    tinted += p[1] > p[0] + 20 && p[1] > p[2] + 15;
  }
  EXPECT_GT(tinted, 4 * 4 * 300);  // four images at twice their size
}

// Marker in the camera of an image, by its labels.
Pose LabelledPose(const Json& gt) {
  Eigen::Matrix3d R_CM;
  Pose X_CM;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col)
      R_CM(row, col) = gt["cam_R_m2c"][static_cast<size_t>(3 * row + col)];
    X_CM.p[row] = gt["cam_t_m2c"][static_cast<size_t>(row)].get<double>() / units::MmFromM(1);
  }
  X_CM.q = R_CM;
  return X_CM;
}

// Drawn or placed, turned in any way, before a station that swings: what a dataset shows is what
// the trial of the same plan begins with.
TEST_F(Dataset, ShowsTheMarkerWhereTheTrialBegins) {
  for (const std::string scenario : {"pool_active", "sea_moored_active"}) {
    SCOPED_TRACE(scenario);
    fs::remove_all(folder_);
    const batch::Plan plan("schema_version: 1\ndescription: starts\nscenario: " + scenario +
                               "\nseeds: 2\nset: {trial.duration_s: 0.1, cameras.rig.width_px: "
                               "160, cameras.rig.height_px: 120}\ncases:\n"
                               "  drawn: {start.roll_rad: 0.3, start.pitch_rad: 0.3}\n"
                               "  placed: {start.position_m: [-1.8, 0.1, -0.95]}\n"
                               "  turned: {start.position_m: [-1.5, 0.1, -0.95],"
                               " start.quaternion_wxyz: [0.96, 0.16, -0.12, 0.2]}\n",
                           "plan");
    MakeDataset(plan, folder_.string(), {.pairs_per_shard = plan.trials()});
    const fs::path shard = folder_ / "train_pbr/000000";
    const Json gt = report::ParseJson(system::ReadWhole(shard / "scene_gt.json"), "gt");
    ASSERT_EQ(std::ssize(gt), 2 * plan.trials());
    for (int64_t i = 0; i < plan.trials(); ++i) {
      trial::Scenario of_trial = plan.ScenarioOf(plan.Trial(i));
      of_trial.pose_source = trial::PoseSource::kTruePose;
      const trial::TrialResult result = trial::RunTrial(of_trial);
      const Pose X_HM = result.log.frames.front().true_X_HM;
      EXPECT_NEAR(result.start.x_m, X_HM.Inverse().p.x(), 1e-9);
      for (const Side side : kSides) {
        const Pose expected = of_trial.rig.MakeRig()[side].X_HC.Inverse() * X_HM;
        const Pose labelled = LabelledPose(gt[std::to_string(2 * i + (side == Side::kRight))][0]);
        EXPECT_NEAR((labelled.p - expected.p).norm(), 0, 1e-6) << i;
        EXPECT_NEAR(AngleBetween(labelled.q, expected.q), 0, 1e-6) << i;
      }
    }
  }
}

TEST_F(Dataset, HasOneMarkerAndWhatPinholesSee) {
  const auto error = [&](const std::string& other) {
    const batch::Plan plan(
        "schema_version: 1\nscenario: pool_active\nseeds: 2\ncases: {a: {}, b: {" + other + "}}\n",
        "plan");
    return testing::MessageOf([&] { MakeDataset(plan, folder_.string(), {}); });
  };
  EXPECT_EQ(error("marker.outer_ring_ratio: 1.9"),
            "marker: that of trial 2 is another one than that of trial 0; a dataset has one");
  EXPECT_EQ(error("cameras.lens.k1: 0.1"),
            "cameras.lens: must be 0: labels are those of pinhole cameras");
  EXPECT_FALSE(fs::exists(folder_));
}

TEST_F(Dataset, RefusesWhatOnlyTrialsHave) {
  const auto error = [](const std::string& key, std::optional<int> seeds = {}) {
    return testing::MessageOf([&] {
      const batch::Plan plan("schema_version: 1\nscenario: pool_active\n" + key + "\n", "plan.yaml",
                             {.seeds = seeds, .refused = RefusedKeys()});
    });
  };
  EXPECT_EQ(
      error("precision: 0.1"),
      "plan.yaml:3: precision: a dataset has `seeds` pairs of images in each cell; give --seeds");
  EXPECT_EQ(error("precision: 0.1", 2), "no error");
  EXPECT_EQ(error("series_every_frames: 1"),
            "plan.yaml:3: series_every_frames: no trial runs: there is no log");
  EXPECT_EQ(error("trial_time_limit_s: 5"),
            "plan.yaml:3: trial_time_limit_s: no trial runs: images are made");
}

TEST_F(Dataset, GoesOnWithWhatIsThereAndMixesNothing) {
  EXPECT_EQ(MakeDataset(SmallPlan(3), folder_.string(), {.pairs_per_shard = 2}).shards, 2);
  const fs::path first = folder_ / "train_pbr/000000/scene_gt.json";
  const auto written = fs::last_write_time(first);
  const std::string second = system::ReadWhole(folder_ / "train_pbr/000001/scene_gt.json");
  fs::remove_all(folder_ / "train_pbr/000001");
  const DatasetSummary again = MakeDataset(SmallPlan(3), folder_.string(), {.pairs_per_shard = 2});
  EXPECT_EQ(again.shards_before, 1);
  EXPECT_EQ(fs::last_write_time(first), written);
  EXPECT_EQ(system::ReadWhole(folder_ / "train_pbr/000001/scene_gt.json"), second);
  EXPECT_THROW(MakeDataset(SmallPlan(4), folder_.string(), {.pairs_per_shard = 2}), ConfigError);
  EXPECT_THROW(MakeDataset(SmallPlan(3), folder_.string(), {.pairs_per_shard = 3}), ConfigError);
}

}  // namespace
}  // namespace turbidock::dataset
