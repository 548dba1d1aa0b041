// What is said to be switched off changes no trial: all keys, trials of a moment, their digests.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/trial/switched_off.h"
#include "experiments/trial/trial.h"
#include "tests/settings/key_cases.h"

namespace turbidock {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::KeyCase;

constexpr const char* kBase = "pool_active";

// How many values of keys are switched off by each key in such a trial, all of which end as it
// does.
std::map<std::string, int> SwitchedOff(
    const std::vector<std::string>& given,
    const std::function<bool(const std::string& by)>& is_tried = [](const auto&) { return true; },
    const char* name = kBase) {
  const trial::Scenario base = trial::LoadScenario(name, given);
  const std::string digest = trial::RunTrial(base).digest;
  std::map<std::string, int> counts;
  for (const KeyCase& of : testing::KeyCasesOf(kBase)) {
    const std::string by = trial::SwitchedOffBy(base, of.key);
    if (by.empty() || !is_tried(by)) continue;
    for (size_t value = 0; value < of.values.size(); ++value) {
      std::vector<std::string> with = given;
      for (const std::string& each : of.Assignments(value)) with.push_back(each);
      EXPECT_EQ(trial::RunTrial(trial::LoadScenario(name, with)).digest, digest)
          << with.back() << ", " << by;
      ++counts[by];
    }
  }
  return counts;
}

TEST(SwitchedOff, ChangesNoTrialOnTheTruePose) {
  const auto counts = SwitchedOff({"estimator.pose_source=true_pose", "trial.duration_s=1",
                                   "start.position_m=[-1.5, 0, 0]", "marker.may_differ=true"});
  EXPECT_GT(counts.at("estimator.pose_source = true_pose"), 150);
  EXPECT_GT(counts.at("control.use = lqg"), 100);
  EXPECT_GT(counts.at("procedure.approach.mode = none"), 80);
  EXPECT_EQ(counts.at("start.position_m = [-1.5, 0, 0]"), 14);
}

TEST(SwitchedOff, ChangesNoTrialThroughTheCameras) {
  const auto counts =
      SwitchedOff({"trial.duration_s=0.1", "marker.may_differ=true", "water.background=pure"},
                  [](const std::string& by) {
                    return by.starts_with("estimator.") || by.starts_with("water.") ||
                           by.starts_with("lights.") || by.starts_with("cameras.");
                  });
  EXPECT_GT(counts.at("estimator.use = rm_ga"), 5);
  EXPECT_GT(counts.at("estimator.pose_source = cameras"), 10);
  EXPECT_EQ(counts.at("water.background = pure"), 6);
  EXPECT_EQ(counts.at("water.snow.particles_per_m3 = 0"), 6);
}

// What lamps and marker throw back, and hues that tags have no use for.
TEST(SwitchedOff, ChangesNoTrialInOtherLight) {
  const std::vector<std::string> brief = {"trial.duration_s=0.1", "marker.may_differ=true"};
  std::vector<std::string> lamps = brief, cone;
  lamps.insert(lamps.end(), {"lights.lamps.enabled=true", "lights.marker.enabled=false"});
  cone = lamps;
  cone.push_back("lights.lamps.beam=cone");
  const auto is_light = [](const std::string& by) { return by.starts_with("lights."); };
  const auto of_cosine = SwitchedOff(lamps, is_light), of_cone = SwitchedOff(cone, is_light);
  EXPECT_EQ(of_cosine.at("lights.lamps.beam = cosine"), 4);
  EXPECT_EQ(of_cone.at("lights.lamps.beam = cone"), 2);
  EXPECT_GT(of_cone.at("lights.marker.enabled = false"), 8);
  const auto of_tags = SwitchedOff(
      brief, [](const std::string& by) { return by == "estimator.use = fiducial"; },
      "pool_fiducial");
  EXPECT_GT(of_tags.at("estimator.use = fiducial"), 20);
}

// To the end: what matters only after docking, or in its last centimetres.
TEST(SwitchedOff, ChangesNoDocking) {
  const std::vector<std::string> given = {"estimator.pose_source=true_pose", "control.use=lqg",
                                          "trial.duration_s=40", "marker.may_differ=true"};
  EXPECT_TRUE(trial::RunTrial(trial::LoadScenario(kBase, given)).success());
  const auto counts = SwitchedOff(given, [](const std::string& by) {
    return by.starts_with("procedure.cycles") || by.starts_with("procedure.blind");
  });
  EXPECT_EQ(counts.at("procedure.cycles = 1"), 2);
  EXPECT_EQ(counts.at("procedure.blind_max_s = 0"), 2);
}

TEST(SwitchedOff, IsRemarkedOnWhereItIsNamed) {
  const auto remarks = [](const std::vector<std::string>& given) {
    return trial::RemarksOn(trial::LoadScenario(kBase, given));
  };
  EXPECT_THAT(remarks({"water.asymmetry=[0.8, 0.8, 0.8]", "water.background=clear"}),
              ElementsAre("water.asymmetry changes no trial: water.background = clear"));
  EXPECT_THAT(remarks({"control.pid={yaw: {kp_per_s2: 2}}"}),
              ElementsAre("control.pid.yaw.kp_per_s2 changes no trial: control.use = lqg"));
  EXPECT_THAT(remarks({"water.asymmetry=[0.8, 0.8, 0.8]"}), IsEmpty());
  EXPECT_THAT(remarks({}), IsEmpty());

  // In a plan, before any trial.
  const auto plan_remarks = [](const std::string& grid) {
    return batch::Plan("schema_version: 1\nscenario: pool_active\nseeds: 1\n" + grid, "plan.yaml")
        .remarks();
  };
  const std::string axis = "water.scattering_per_m: [[0.1, 0.1, 0.1], [0.2, 0.2, 0.2]]";
  EXPECT_THAT(plan_remarks("set: {water.background: clear}\ngrid: {" + axis + "}\n"),
              ElementsAre("water.scattering_per_m changes no trial: water.background = clear"));
  EXPECT_THAT(plan_remarks("grid: {" + axis + "}\n"), IsEmpty());
  // Only of what no trial reads, and once.
  const std::string gain = "set: {control.pid.sway.kp_per_s2: 3}\n";
  EXPECT_THAT(plan_remarks(gain + "grid: {control.use: [lqg, pid]}\n"), IsEmpty());
  EXPECT_THAT(plan_remarks(gain + "grid: {control.use: [lqg, p_voltage]}\n"),
              ElementsAre("control.pid.sway.kp_per_s2 changes no trial: control.use = lqg"));
  const std::string blind =
      "schema_version: 1\nscenario: pool_active\nset: {water.milk_ml_m3: 9, "
      "estimator.pose_source: true_pose}\n";
  EXPECT_EQ(batch::Plan(blind, "plan.yaml").remarks().size(), 1u);
  EXPECT_THAT(batch::Plan(blind, "plan.yaml", {.sees_images = true}).remarks(), IsEmpty());
}

}  // namespace
}  // namespace turbidock
