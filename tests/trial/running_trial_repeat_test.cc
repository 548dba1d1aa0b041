// A trial that is watched, paused or interfered with.

#include "experiments/trial/running_trial.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/trial/trial.h"
#include "tests/support/message_of.h"

namespace turbidock::trial {
namespace {

using ::testing::HasSubstr;

Scenario Short(std::vector<std::string> assignments = {}) {
  assignments.insert(assignments.begin(), {"trial.duration_s=1.5", "trial.seed=11"});
  return LoadScenario("sea_night_active", assignments);
}

// What is set at which frames.
using Script = std::multimap<int64_t, std::string>;

TrialResult Played(const Scenario& scenario, const Script& script) {
  RunningTrial trial(scenario);
  for (int64_t frame = 0; !trial.ended(); ++frame) {
    for (auto [at, end] = script.equal_range(frame); at != end; ++at) trial.Set(at->second);
    trial.Step();
  }
  return trial.Finish();
}

TEST(RunningTrial, ATrialThatIsLookedAtEndsAsOneThatIsNot) {
  const TrialResult alone = RunTrial(Short());
  RunningTrial watched(Short());
  for (int frame = 0; !watched.ended(); ++frame) {
    watched.SetFullFrame(frame % 3 == 0);
    watched.Step();
    EXPECT_EQ(std::ssize(watched.log().frames), frame + 1);
    EXPECT_FALSE(watched.latest_images().left.empty());
  }
  const TrialResult result = watched.Finish();
  EXPECT_EQ(result.digest, alone.digest);
  EXPECT_TRUE(result.changes.empty());
  EXPECT_EQ(result.outcome, alone.outcome);
}

// Each of these, from the 21st frame on, makes another trial, the same one each time.
TEST(RunningTrial, EveryChangeCountsAndCanBeRepeated) {
  const std::string digest = RunTrial(Short()).digest;
  for (const std::string change :
       {"water.milk_ml_m3=40", "lights.marker.rim_radiance_w_m2_sr=0.01",
        "lights.lamps.enabled=true", "sea.current.surface_velocity_mps[1]=0.2", "sea.state=rough",
        "sea.jonswap.significant_height_m=0.3", "control.use=p_voltage",
        "control.lqg.sway.effort_share=0.5"}) {
    SCOPED_TRACE(change);
    const TrialResult changed = Played(Short(), {{20, change}});
    EXPECT_NE(changed.digest, digest);
    ASSERT_EQ(changed.changes.size(), 1u);
    EXPECT_EQ(changed.changes[0].frame, 20);
    EXPECT_NEAR(changed.changes[0].time_s, 20 / 30.0, 1e-12);
    EXPECT_EQ(changed.changes[0].key + "=" + changed.changes[0].value, change);
    EXPECT_EQ(Played(Short(), {{20, change}}).digest, changed.digest);
    EXPECT_NE(Played(Short(), {{21, change}}).digest, changed.digest);
  }
}

TEST(RunningTrial, AChangeBeforeTheFirstFrameMovesTheVehicleAsTheScenarioWould) {
  // not the search for gusts: their stream is drawn from at the start
  for (const std::string change : {"sea.current.surface_velocity_mps[1]=0.2", "sea.state=rough",
                                   "water.milk_ml_m3=30", "control.use=pid"}) {
    SCOPED_TRACE(change);
    const TrialResult begun = RunTrial(Short({change}));
    const TrialResult changed = Played(Short(), {{0, change}});
    EXPECT_EQ(changed.log.frames.back().true_X_WB.p, begun.log.frames.back().true_X_WB.p);
    EXPECT_EQ(changed.log.frames.back().est_X_HM.p, begun.log.frames.back().est_X_HM.p);
    EXPECT_NE(changed.digest, begun.digest) << "the change itself is part of it";
  }
}

TEST(RunningTrial, APushMovesTheVehicleThere) {
  const auto pushed = [](const Eigen::Vector3d& f_W) {
    RunningTrial trial(Short({"vehicle.thrusters.effectiveness=[0, 0, 0, 0]"}));
    trial.Push(f_W);
    while (!trial.ended()) trial.Step();
    return trial.Finish();
  };
  const TrialResult alone = pushed({0, 0, 0});
  EXPECT_TRUE(alone.changes.empty());
  for (int axis = 0; axis < 3; ++axis) {
    const TrialResult result = pushed(4 * Eigen::Vector3d::Unit(axis));
    const Eigen::Vector3d way =
        result.log.frames.back().true_X_WB.p - alone.log.frames.back().true_X_WB.p;
    EXPECT_GT(way[axis], 0.02);
    ASSERT_EQ(result.changes.size(), 1u);
    EXPECT_EQ(result.changes[0].key, "push");
  }
  const TrialResult result = pushed({0.5, -1, 2});
  EXPECT_EQ(result.changes[0].value, "[0.5, -1, 2]");
  EXPECT_THAT(report::JsonText(result), HasSubstr("\"key\": \"push\""));
}

TEST(RunningTrial, RefusesWhatItCannotFollow) {
  RunningTrial trial(Short());
  const auto message = [&](const std::string& assignment) {
    return testing::MessageOf([&] { trial.Set(assignment); });
  };
  for (const char* key : {"cameras.rig.baseline_m=0.2", "control.playback.begin_s=1"})
    EXPECT_THAT(message(key), HasSubstr("cannot change while the trial runs; water, "
                                        "lights.lamps, lights.marker, sea, control.use, "
                                        "control.levelling, control.p_voltage, "
                                        "control.pid, control.lqg can"));
  EXPECT_THAT(message("control.use=playback"), HasSubstr("control.playback.file: is empty"));
  EXPECT_THAT(message("water.milk_ml_m3=-1"), HasSubstr("must be in [0, 2000]"));
  EXPECT_THAT(message("water.milk_ml=1"), HasSubstr("did you mean milk_ml_m3"));
  EXPECT_THAT(message("water.milk_ml_m3"), HasSubstr("must be KEY=VALUE"));
  EXPECT_THAT(message("control.lqg.sway.effort_share=0"), HasSubstr("must be in [1e-04, 100]"));
  EXPECT_TRUE(trial.changes().empty());
  while (!trial.ended()) trial.Step();
  EXPECT_EQ(trial.Finish().digest, RunTrial(Short()).digest);
}

// Values about the limits of what can be: a lamp in the hull, behind a docked vehicle's marker, a
// light for a ball that the scene does not have.
const std::vector<std::string> kTried = {
    "lights.lamps.shift_m=[0.02, 0, 0]",
    "lights.lamps.shift_m=[-0.25, -0.1, -0.05]",
    "lights.lamps.shift_m=[-0.2, -0.05, 0]",
    "lights.lamps.shift_m=[0.28, 0, 0]",
    "lights.lamps.shift_m=[5, 0, 0]",
    "lights.lamps.enabled=false",
    "lights.lamps.intensity_w_sr=[-1, 0, 0]",
    "lights.marker.balls=[{name: purple, color: [1, 0, 1]}]",
    "lights.marker.balls=[{name: red, color: [1, 0, 0]}]",
    "lights.marker.balls[0].name=violet",
    "lights.marker.balls[0].current_factor=3",
    "lights.marker.balls[0].current_factor=300",
    "lights.marker.enabled=false",
    "water.milk_ml_m3=60",
    "water.milk_ml_m3=6000",
    "sea.state=rough",
    "sea.state=stormy",
    "sea.current.gust_std_mps=3",
    "sea.waves=[{height_m: 0.1, period_s: 0.1}]",
    "control.use=p_voltage",
    "control.use=pid",
    "control.use=none",
    "control.pid.surge.kp_per_s2=-1",
    "control.lqg.sway.effort_share=0",
    "control.levelling.kp_per_s2=5",
    "control.levelling.kp_per_s2=500",
};

// Tries each on a trial under way; returns how many it refuses.
int RefusalsOf(const std::string& scenario, std::vector<std::string> settings) {
  settings.insert(
      settings.begin(),
      {"trial.duration_s=0.3", "trial.seed=3", "cameras.rig.width_px=160",
       "cameras.rig.height_px=120", "lights.lamps.enabled=true", "lights.lamps.shift_m=[0, 0, 0]",
       "lights.marker.enabled=true", "procedure.docking_x_m=0.25", "procedure.docked_x_m=0.25"});
  const Scenario base = LoadScenario(scenario, settings);
  const std::string digest = RunTrial(base).digest;
  int refused = 0;
  for (const std::string& tried : kTried) {
    SCOPED_TRACE(scenario + " " + tried);
    std::vector<std::string> from_the_start = settings;
    from_the_start.push_back(tried);
    const std::string at_the_start =
        testing::MessageOf([&] { RunningTrial trial(LoadScenario(scenario, from_the_start)); });
    RunningTrial trial(base);
    for (int i = 0; i < 2; ++i) trial.Step();
    const std::string while_it_runs = testing::MessageOf([&] { trial.Set(tried); });
    EXPECT_EQ(while_it_runs == "no error", at_the_start == "no error")
        << "at the start: " << at_the_start << "; while it runs: " << while_it_runs;
    if (while_it_runs == "no error") continue;
    ++refused;
    EXPECT_TRUE(trial.changes().empty());
    EXPECT_NO_THROW({
      while (!trial.ended()) trial.Step();
    });
    EXPECT_EQ(trial.Finish().digest, digest);
  }
  return refused;
}

// With faults of a light and of the rig the world computes its light anew from what it has stored.
TEST(RunningTrial, SetTakesWhatAStartTakesAndARefusalChangesNothing) {
  const std::vector<std::string> faults = {
      "faults.lights=[{light: lamp_left, factor: 0.5, begin_s: 0.1}]",
      "faults.misalignments=[{camera: left, begin_s: 0.2}]"};
  EXPECT_GE(RefusalsOf("sea_night_passive", faults), 12);
  EXPECT_GE(RefusalsOf("bluerov2_sea_night", {"estimator.pose_source=true_pose"}), 9);
}

TEST(RunningTrial, CutOffItIsInterrupted) {
  RunningTrial trial(Short());
  for (int i = 0; i < 10; ++i) trial.Step();
  const TrialResult result = trial.Finish();
  EXPECT_EQ(result.outcome, Outcome::kInterrupted);
  EXPECT_EQ(result.reason, "stopped at 0.3 s");
  EXPECT_EQ(result.log.frames.size(), 10u);
}

}  // namespace
}  // namespace turbidock::trial
