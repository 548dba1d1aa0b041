// Open loop: what was commanded is run again.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "experiments/system/output_path.h"
#include "experiments/trial/motion.h"
#include "experiments/trial/recorded.h"
#include "experiments/trial/running_trial.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial.h"
#include "experiments/trial/world.h"
#include "tests/support/own_folder.h"

namespace turbidock::trial {
namespace {

namespace fs = std::filesystem;
using Settings = std::vector<std::string>;
using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

class PlaybackOfTrials : public testing::OwnFolder {
 protected:
  static Settings With(Settings settings, const Settings& more) {
    settings.insert(settings.end(), more.begin(), more.end());
    return settings;
  }
  // What a trial of the pool says of a file of commands; nothing: it runs.
  std::string RefusalOf(const std::string& csv, const Settings& more = {}) const {
    try {
      RunTrial(LoadScenario(
          "pool_active",
          With({"estimator.pose_source=true_pose", "trial.duration_s=0.2", "control.use=playback",
                "control.playback.file=" + File("commands.csv", csv)},
               more)));
      return "";
    } catch (const ConfigError& error) {
      return error.what();
    }
  }
};

const Settings kClosedLoop = {"estimator.pose_source=true_pose", "trial.seed=5",
                              "trial.duration_s=25", "sea.state=moderate",
                              "sea.current.gust_std_mps=0.02"};

// Over the frames that both have.
double LargestDifference_m(const TrialLog& a, const TrialLog& b, size_t from = 0) {
  double largest_m = 0;
  for (size_t i = 0; i < std::min(a.frames.size() - from, b.frames.size()); ++i) {
    const Pose &p = a.frames[from + i].true_X_WB, &q = b.frames[i].true_X_WB;
    largest_m = std::max(largest_m, (p.p - q.p).norm() + AngleBetween(p.q, q.q));
  }
  return largest_m;
}

TEST_F(PlaybackOfTrials, TheCommandsOfATrialGiveItsTrajectory) {
  for (const std::string scenario : {"sea_night_active", "bluerov2_sea_night"}) {
    const Settings settings = With(kClosedLoop, {"control.use=pid"});
    const TrialResult first = RunTrial(LoadScenario(scenario, settings));
    const std::string csv = File("trajectory.csv", Series::Of(first.log).Csv());
    const auto replayed = [&](const Settings& more) {
      return RunTrial(LoadScenario(
          scenario,
          With(settings, With({"control.use=playback", "control.playback.file=" + csv}, more))));
    };
    const TrialResult again = replayed({});
    EXPECT_EQ(again.log.frames.size(), first.log.frames.size());
    EXPECT_EQ(again.outcome, first.outcome);
    EXPECT_LT(LargestDifference_m(first.log, again.log), 1e-12) << scenario;
    EXPECT_EQ(again.digest, first.digest);
    // and as soon as something differs, another
    const TrialResult other = replayed({"vehicle.rigid_body.mass_kg=14"});
    EXPECT_GT(LargestDifference_m(first.log, other.log), 1e-3) << scenario;
  }
}

TEST_F(PlaybackOfTrials, BeginsWhereALogHasTheVehicle) {
  // Without lag nothing but pose and velocity is the vehicle's state.
  const Settings settings = {"estimator.pose_source=true_pose", "trial.seed=5",
                             "trial.duration_s=12", "control.use=pid", "vehicle.thrusters.lag_s=0"};
  const TrialResult first = RunTrial(LoadScenario("pool_active", settings));
  const std::string csv = File("trajectory.csv", Series::Of(first.log).Csv());
  constexpr size_t kFrom = 150;
  const FrameRecord& from = first.log.frames[kFrom];
  const auto list = [](const auto& v) {
    return fmt::format("[{}, {}, {}]", FormatNumber(v.x()), FormatNumber(v.y()),
                       FormatNumber(v.z()));
  };
  const Eigen::Quaterniond& q = from.true_X_WB.q;
  const Scenario scenario = LoadScenario(
      "pool_active",
      With(settings, {"control.use=playback", "control.playback.file=" + csv,
                      "control.playback.begin_s=" + FormatNumber(from.time_s), "trial.duration_s=5",
                      "start.position_m=" + list(from.true_X_WB.p),
                      fmt::format("start.quaternion_wxyz=[{}, {}, {}, {}]", FormatNumber(q.w()),
                                  FormatNumber(q.x()), FormatNumber(q.y()), FormatNumber(q.z())),
                      "start.velocity_mps=" + list(from.true_V_WB_B.v),
                      "start.turn_rate_rad_s=" + list(from.true_V_WB_B.w)}));
  const TrialResult again = RunTrial(scenario);
  EXPECT_LT(LargestDifference_m(first.log, again.log, kFrom), 1e-9);
  EXPECT_EQ(again.start.x_m, AxesPose::Of(from.true_X_HM.Inverse()).x_m);
  // at rest it would go elsewhere
  Scenario at_rest = scenario;
  at_rest.start.velocity_mps.clear();
  EXPECT_GT(LargestDifference_m(first.log, RunTrial(at_rest).log, kFrom), 1e-3);
}

TEST_F(PlaybackOfTrials, TheMotionOfEveryStep) {
  const Scenario scenario = LoadScenario(
      "pool_active", {"estimator.pose_source=true_pose", "trial.duration_s=3", "control.use=pid",
                      "sea.current.surface_velocity_mps=[0.1, 0, 0]"});
  MotionLog motion(ThrusterNamesOf(scenario));
  TrialOptions options;
  options.on_tick = [&](const MotionTick& tick) { motion.Add(tick); };
  const TrialResult seen = RunTrial(scenario, options), unseen = RunTrial(scenario);
  EXPECT_EQ(seen.digest, unseen.digest);
  const config::NumberTable& table = motion.table();
  const int ticks = scenario.clock.ticks_per_frame;
  ASSERT_EQ(table.rows(), seen.log.frames.size() * ticks);
  for (size_t i = 0; i < seen.log.frames.size(); ++i) {
    const FrameRecord& frame = seen.log.frames[i];
    EXPECT_DOUBLE_EQ((*table.Find("time_s"))[i * ticks], frame.time_s);
    EXPECT_EQ((*table.Find("vehicle_x_m"))[i * ticks], frame.true_X_WB.p.x());
    EXPECT_EQ((*table.Find("sway_v"))[i * ticks], frame.command.volts[2]);
  }
  EXPECT_EQ((*table.Find("water_x_mps"))[7], 0.1);
  // thrust follows the command with the thruster's lag
  const auto& thrust = *table.Find("heave_thrust_newton");
  EXPECT_EQ(thrust[0], 0);
  EXPECT_GT(*std::ranges::max_element(thrust) - *std::ranges::min_element(thrust), 0.01);
  // and reads back
  const std::string csv = File("motion.csv", table.Csv());
  const config::NumberTable again = config::ReadNumberTable(csv);
  EXPECT_EQ(again.names, table.names);
  EXPECT_EQ(again.columns, table.columns);
}

TEST(Playback, WithinATimeEachCommandHasItsShare) {
  const auto row = [](double time_s, double volts) {
    return control::Playback::Row{time_s, {.volts = {volts}}};
  };
  const control::Playback playback({row(1, 3), row(1.5, 4), row(1.75, 2)}, 1);
  const auto within = [&](double begin_s, double end_s) {
    std::vector<std::pair<double, double>> found;
    for (const auto& [share, command] : playback.Within(begin_s, end_s))
      found.emplace_back(share, command->volts[0]);
    return found;
  };
  const auto are = [](const auto&... parts) {
    return ElementsAre(Pair(DoubleEq(parts.first), parts.second)...);
  };
  using P = std::pair<double, double>;
  EXPECT_THAT(within(1.1, 1.4), are(P(1, 3)));
  EXPECT_THAT(within(1.25, 1.75), are(P(0.5, 3), P(0.5, 4)));
  EXPECT_THAT(within(1, 2), are(P(0.5, 3), P(0.25, 4), P(0.25, 2)));
  EXPECT_THAT(within(0.5, 1.5), are(P(0.5, kNeutralVolts), P(0.5, 3))) << "off before the first";
  EXPECT_THAT(within(1.75, 2.25), are(P(0.5, 2), P(0.5, kNeutralVolts))) << "and after the last";
  EXPECT_THAT(within(2.1, 2.2), are(P(1, kNeutralVolts)));
}

TEST_F(PlaybackOfTrials, EveryUnitOfACommand) {
  const Scenario scenario = LoadScenario("pool_active", {});
  const control::VehicleModel vehicle = ModelOf(scenario);
  const auto first = [&](const std::string& csv) {
    return CommandsIn(config::ReadNumberTable(File("c.csv", csv)), "c.csv", vehicle)[0]
        .command.volts;
  };
  const auto volts = first("time_s,surge_left_v,surge_right_v,sway_v,heave_v\n0,3,2,2.5,5\n");
  const auto pulses = first(
      "time_s,surge_left_pwm_us,surge_right_pwm_us,sway_pwm_us,heave_pwm_us\n"
      "0,1580,1420,1500,1900\n");
  for (size_t i = 0; i < volts.size(); ++i) EXPECT_DOUBLE_EQ(volts[i], pulses[i]);
  const auto newtons =
      first("time_s,surge_left_newton,surge_right_newton,sway_newton,heave_newton\n0,1,-1,0,4.9\n");
  EXPECT_NEAR(vehicle.thrusters[0].curve.Thrust(newtons[0]), 1, 1e-9);
  EXPECT_NEAR(vehicle.thrusters[1].curve.Thrust(newtons[1]), -1, 1e-9);
  EXPECT_EQ(newtons[2], kNeutralVolts);
  const auto axes = first("time_s,surge_newton,sway_newton,heave_newton,yaw_newton_m\n0,1,0,2,0\n");
  EXPECT_NEAR(vehicle.thrusters[0].curve.Thrust(axes[0]), 0.5, 1e-9);
  EXPECT_NEAR(vehicle.thrusters[3].curve.Thrust(axes[3]), 2, 1e-9);
}

TEST_F(PlaybackOfTrials, WhatIsWrongIsSaidInALine) {
  const std::string head = "time_s,surge_left_v,surge_right_v,sway_v,heave_v\n";
  EXPECT_EQ(RefusalOf(head + "0,3,3,2.5,2.5\n"), "");
  EXPECT_THAT(RefusalOf(head + "0,1500,1500,1500,1600\n"),
              HasSubstr("commands.csv:2: surge_left_v = 1500, must be in [0, 5]; it looks like a "
                        "pulse width: name the column surge_left_pwm_us"));
  EXPECT_THAT(RefusalOf(head + "0,2.5,2.5,-0.5,2.5\n"), HasSubstr("a share of full thrust"));
  EXPECT_THAT(RefusalOf("time_s,surge_left_pwm_us,surge_right_pwm_us,sway_pwm_us,heave_pwm_us\n"
                        "0,3,3,3,3\n"),
              HasSubstr("it looks like volts"));
  EXPECT_THAT(RefusalOf(head + "0,3,3,3,3\n0.1,3,3,3,3\n0.05,3,3,3,3\n"),
              HasSubstr("commands.csv:4: the clock runs backwards, from 0.1 to 0.05 s"));
  EXPECT_THAT(RefusalOf("time_s,t200_1_v,t200_2_v\n0,3,3\n"),
              HasSubstr("it has t200_1_v, t200_2_v, the vehicle wants THRUSTER_v"));
  EXPECT_THAT(RefusalOf("time_s,surge_left_v,surge_right_v,sway_v\n0,3,3,3\n"),
              HasSubstr("has no column heave_v; the vehicle's thrusters are surge_left"));
  EXPECT_THAT(RefusalOf("time_s,surge_left_v,surge_right_v,sway_v,heave_v,bow_v\n0,3,3,3,3,3\n"),
              HasSubstr("bow_v is of no thruster of the vehicle"));
  EXPECT_THAT(RefusalOf(head + "0,3,3,,3\n"), HasSubstr("commands for some thrusters only"));
  EXPECT_THAT(RefusalOf(head + "9,3,3,3,3\n"),
              HasSubstr("control.playback.begin_s: 0 leaves no command"));
  EXPECT_EQ(RefusalOf(head + "9,3,3,3,3\n", {"control.playback.begin_s=9"}), "");
  EXPECT_THAT(RefusalOf("surge_left_v\n3\n"), HasSubstr("has no column time_s"));
  std::string gap = head;
  for (int i = 0; i < 20; ++i) gap += fmt::format("{},3,3,3,3\n", 0.1 * i + (i < 15 ? 0 : 4));
  EXPECT_THAT(RefusalOf(gap), HasSubstr("no command from 1.400 s on for 4.100 s"));
  EXPECT_THROW(LoadScenario("pool_active", {"control.use=playback"}), ConfigError);
  EXPECT_THROW(LoadScenario("pool_active", {"start.quaternion_wxyz=[1, 0, 0, 0]"}), ConfigError);
  EXPECT_THROW(LoadScenario("pool_active", {"start.position_m=[1, 0]"}), ConfigError);
}

TEST_F(PlaybackOfTrials, FilesCountByTheirContent) {
  const std::string commands =
      File("c.csv", "time_s,surge_left_v,surge_right_v,sway_v,heave_v\n0,3,3,2.5,2.5\n");
  const std::string current = File("w.csv", "time_s,water_x_mps,water_y_mps\n0,0.1,0\n10,0,0.1\n");
  Scenario scenario = LoadScenario(
      "pool_active",
      {"control.use=playback", "control.playback.file=" + commands, "sea.current.file=" + current});
  scenario.model_files = ModelFilesOf(scenario);
  EXPECT_EQ(ChangedModels(scenario, ModelFilesOf(scenario)), "");
  std::ofstream(current, std::ios::app) << "20,0,0\n";
  EXPECT_EQ(ChangedModels(scenario, ModelFilesOf(scenario)),
            current + " has changed since the scenario was written");
}

TEST_F(PlaybackOfTrials, TheProcedureOnlyLooksOn) {
  // Blind from the start: a controller would have been given up long before.
  const Scenario scenario = LoadScenario(
      "pool_active",
      {"estimator.pose_source=true_pose", "trial.duration_s=6", "procedure.give_up_s=1",
       "procedure.return_to_approach_s=1", "procedure.lost_after_s=0.5",
       "estimator.true_pose.nearest_m=1.3", "start.distance_min_m=1.35",
       "start.distance_max_m=1.35", "control.use=playback",
       "control.playback.file=" + File("c.csv",
                                       "time_s,surge_left_v,surge_right_v,sway_v,"
                                       "heave_v\n0,3.2,3.2,2.5,2.5\n3,2.5,2.5,2.5,2.5\n")});
  const TrialResult result = RunTrial(scenario);
  EXPECT_EQ(result.outcome, Outcome::kTimeout) << result.reason;
  EXPECT_EQ(result.log.frames.size(), 180u);
  RunningTrial running(scenario);
  EXPECT_THROW(running.Set("control.use=pid"), ConfigError);
  EXPECT_THROW(running.Set("control.playback.begin_s=1"), ConfigError);
}

TEST_F(PlaybackOfTrials, AMeasuredCurrentCarriesTheVehicle) {
  const std::string current = File("w.csv",
                                   "time_s,speed_mps,direction_rad\n0,0,0\n2,0.2,0\n"
                                   "6,0.2,1.5707963267948966\n");
  const Scenario scenario = LoadScenario(
      "pool_active",
      {"estimator.pose_source=true_pose", "trial.duration_s=8", "sea.current.file=" + current,
       "control.use=playback", "start.position_m=[-2, 0, -0.8]",
       "control.playback.file=" + File("c.csv",
                                       "time_s,surge_left_v,surge_right_v,sway_v,"
                                       "heave_v\n0,2.5,2.5,2.5,2.5\n")});
  const vehicle::Sea sea = SeaOf(scenario, Rng(0, 0));
  vehicle::Sea now = sea;
  now.Step(0.01, 1);
  EXPECT_TRUE(now.At({0, 0, -1}, 1).v_W.isApprox(Eigen::Vector3d(0.1, 0, 0), 1e-12));
  EXPECT_TRUE(now.At({0, 0, -1}, 1).a_W.isApprox(Eigen::Vector3d(0.1, 0, 0), 1e-12));
  now.Step(0.01, 4);  // half way in its turn
  EXPECT_TRUE(now.At({0, 0, -1}, 4).v_W.isApprox(Eigen::Vector3d(0.1, 0.1, 0), 1e-12));
  now.Step(0.01, 100);
  EXPECT_TRUE(now.At({0, 0, -1}, 100).v_W.isApprox(Eigen::Vector3d(0, 0.2, 0), 1e-12));
  EXPECT_EQ(now.At({0, 0, -1}, 100).a_W.norm(), 0);
  const TrialResult result = RunTrial(scenario);
  const Eigen::Vector3d moved =
      result.log.frames.back().true_X_WB.p - result.log.frames.front().true_X_WB.p;
  EXPECT_GT(moved.x(), 0.2);
  EXPECT_GT(moved.y(), 0.2);
  EXPECT_THROW(LoadScenario("pool_active", {"sea.current.file=" + current,
                                            "sea.current.surface_velocity_mps=[0.1, 0, 0]"}),
               ConfigError);
  for (const std::string columns :
       {"speed_mps", "speed_mps,direction_rad,water_z_mps", "water_x_mps,water_z_mps",
        "water_x_mps,water_y_mps,speed_mps", "water_x_mps,water_y_mps,speed_mps,direction_rad"}) {
    vehicle::SeaParams of_both;
    std::string row = "0,0";
    for (int64_t n = std::ranges::count(columns, ','); n > 0; --n) row += ",0";
    of_both.current.file = File("w.csv", "time_s," + columns + "\n" + row + "\n");
    EXPECT_THAT([&] { CurrentOf(of_both); },
                ::testing::ThrowsMessage<ConfigError>(HasSubstr("not of both")))
        << columns;
  }
}

}  // namespace
}  // namespace turbidock::trial
