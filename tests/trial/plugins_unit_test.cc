// Laws and estimators of a program's own: chosen, set, checked and copied like ours, and named in
// what goes wrong.

#include "experiments/trial/plugins.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "control/lqg.h"
#include "control/p_voltage.h"
#include "experiments/trial/plugin_of.h"
#include "experiments/trial/running_trial.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "tests/support/message_of.h"
#include "vision/rm_ga.h"

namespace turbidock::trial {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using turbidock::testing::MessageOf;

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

// The published controller once more, written apart from it.
class CopiedController final : public control::Controller {
 public:
  struct Params {
    double surge_v_per_m = 20, across_v_per_m = 30, yaw_v = 2;
    control::SetpointParams setpoint;
    control::VoltsAllocationParams allocation;

    static void Fields(auto& self, auto&& field) {
      field("surge_v_per_m", self.surge_v_per_m, InRange(0, 100), "volts a metre of x");
      field("across_v_per_m", self.across_v_per_m, InRange(0, 100), "volts a metre of y and z");
      field("yaw_v", self.yaw_v, InRange(0, 100), "volts for eps3");
      field("setpoint", self.setpoint, Finite(), "as our controllers have it");
      field("allocation", self.allocation, Finite(), "as the published controller has it");
    }
  };
  CopiedController(const Params& params, const ClockParams&) : params_(params) {}

  void Observe(const control::Observation& seen) override { position_ = seen.position; }
  control::Axes Demand(const control::Reference& wanted) override {
    const control::Axes e = position_ - wanted.position;
    const auto limit = [](double v, double most) { return std::clamp(v, -most, most); };
    return {limit(params_.surge_v_per_m * e[0], 0.5), limit(params_.across_v_per_m * e[1], 2.5),
            limit(params_.across_v_per_m * e[2], 2.5),
            limit(params_.yaw_v * (std::sin(position_[3] / 2) - std::sin(wanted.position[3] / 2)),
                  2.5)};
  }
  void OnCommandApplied(int64_t, const control::Axes&) override {}

 private:
  Params params_;
  control::Axes position_ = control::Axes::Zero();
};

// What may go wrong in a plug-in, at frame 20.
enum class Wrong { kNothing, kThrows, kThrowsAnInt, kNan, kNoRotation, kFitness };
constexpr auto Names(Wrong) {
  using enum Wrong;
  return EnumList<Wrong>({{kNothing, "nothing"},
                          {kThrows, "throws"},
                          {kThrowsAnInt, "throws_an_int"},
                          {kNan, "nan"},
                          {kNoRotation, "no_rotation"},
                          {kFitness, "fitness"}});
}
struct WrongParams {
  Wrong wrong = Wrong::kNothing;
  double share = 0.5;
  static void Fields(auto& self, auto&& field) {
    field("wrong", self.wrong, Finite(), "what goes wrong");
    field("share", self.share, Between(0, 1), "how much of it");
  }
  void Check(const std::string& path) const {
    if (share > 0.9 && wrong == Wrong::kNothing)
      throw ConfigError(JoinKey(path, "share") + ": nothing is wrong");
  }
};
constexpr int64_t kWhen = 20;

void Misbehave(Wrong wrong, int64_t frame) {
  if (frame != kWhen) return;
  if (wrong == Wrong::kThrows) throw std::out_of_range("no such gain");
  if (wrong == Wrong::kThrowsAnInt) throw 42;
}

class WrongLaw final : public control::Controller {
 public:
  using Params = WrongParams;
  WrongLaw(const Params& params, const ClockParams&) : params_(params) {}
  void Observe(const control::Observation& seen) override { frame_ = seen.frame; }
  control::Axes Demand(const control::Reference&) override {
    Misbehave(params_.wrong, frame_);
    return {params_.wrong == Wrong::kNan ? kNotANumber : 0, 0, 0, 0};
  }
  void OnCommandApplied(int64_t, const control::Axes&) override {}

 private:
  Params params_;
  int64_t frame_ = 0;
};

// RM-GA inside an estimator of one's own.
class WrappedEstimator final : public vision::PoseEstimator {
 public:
  using Params = WrongParams;
  WrappedEstimator(const Params& params, const EstimatorSetup& setup)
      : params_(params), search_({}, setup.marker, setup.hue, setup.rig, setup.rng) {}
  const PoseEstimate& Update(const StereoImage& seen) override {
    Misbehave(params_.wrong, seen.frame);
    estimate_ = search_.Update(seen);
    if (seen.frame == kWhen && params_.wrong == Wrong::kNan) estimate_.X_HM.p.y() = kNotANumber;
    if (seen.frame == kWhen && params_.wrong == Wrong::kNoRotation) estimate_.X_HM.q.coeffs() *= 2;
    if (seen.frame == kWhen && params_.wrong == Wrong::kFitness) estimate_.fitness = 1.5;
    return estimate_;
  }
  void Reset() override { search_.Reset(); }
  std::string_view name() const override { return "wrapped"; }

 private:
  Params params_;
  vision::RmGa search_;
  PoseEstimate estimate_;
};

class Mine final : public control::Controller {
 public:
  struct Params {
    double gain = 10;
    static void Fields(auto& self, auto&& field) {
      field("gain", self.gain, InRange(0, 100), "newtons a metre");
    }
  };
  explicit Mine(const Params& params) : params_(params) {}
  void Observe(const control::Observation& seen) override { position_ = seen.position; }
  control::Axes Demand(const control::Reference& wanted) override {
    return params_.gain * (position_ - wanted.position);
  }
  void OnCommandApplied(int64_t, const control::Axes&) override {}

 private:
  Params params_;
  control::Axes position_ = control::Axes::Zero();
};

// lqg with a model of its own, which may go wrong.
class Predicting final : public control::Controller {
 public:
  struct Params : control::LqgParams {
    bool wrong = false;
    static void Fields(auto& self, auto&& field) {
      control::LqgParams::Fields(self, field);
      field("wrong", self.wrong, Finite(), "whether it predicts what is no number");
    }
  };
  Predicting(const Params& params, const control::VehicleModel& vehicle, const ClockParams& clock)
      : wrong_(params.wrong), lqg_(params, vehicle, clock) {}
  void Observe(const control::Observation& seen) override { lqg_.Observe(seen); }
  control::Axes Demand(const control::Reference& wanted) override { return lqg_.Demand(wanted); }
  std::optional<control::Axes> Predict(int64_t frame) override {
    if (wrong_) return control::Axes::Constant(kNotANumber);
    return lqg_.Predict(frame);
  }
  void OnCommandApplied(int64_t frame, const control::Axes& given) override {
    lqg_.OnCommandApplied(frame, given);
  }

 private:
  bool wrong_;
  control::Lqg lqg_;
};

// Cannot steer any vehicle.
struct RefusingParams {
  static void Fields(auto&, auto&&) {}
};
class RefusingController final : public control::Controller {
 public:
  using Params = RefusingParams;
  explicit RefusingController(const Params&) { throw ConfigError("the vehicle has no rudder"); }
  void Observe(const control::Observation&) override {}
  control::Axes Demand(const control::Reference&) override { return control::Axes::Zero(); }
  void OnCommandApplied(int64_t, const control::Axes&) override {}
};

Plugins Ours() {
  Plugins plugins;
  plugins.AddController<CopiedController>("copied");
  plugins.AddController<WrongLaw>("wrong_law");
  plugins.AddEstimator<WrappedEstimator>("wrapped");
  return plugins;
}

Scenario Load(std::vector<std::string> assignments) {
  assignments.emplace_back("estimator.pose_source=true_pose");
  return LoadScenario("paper_sea_night_active", assignments, "", Ours());
}

TEST(Plugins, ACopyOfThePublishedLawSteersTheSameTrial) {
  const Scenario paper = Load({"trial.duration_s=12"});
  const TrialResult ours = RunTrial(paper);
  const auto& published = paper.plugins.ParamsOf<control::PVoltageParams>();
  const std::vector<std::string> same = {
      "trial.duration_s=12", "control.use=copied",
      "control.copied.surge_v_per_m=" + FormatNumber(published.surge.kp_v_per_m),
      "control.copied.across_v_per_m=" + FormatNumber(published.sway.kp_v_per_m),
      "control.copied.yaw_v=" + FormatNumber(published.yaw.kp_v)};
  const Scenario scenario = Load(same);
  EXPECT_EQ(scenario.controller_name(), "copied");
  EXPECT_EQ(RunTrial(scenario).digest, ours.digest);
  std::vector<std::string> other = same;
  other.emplace_back("control.copied.across_v_per_m=12");
  EXPECT_NE(RunTrial(Load(other)).digest, ours.digest);
  other = same;
  other.insert(other.end(), {"control.copied.setpoint.enabled=true"});
  EXPECT_NE(RunTrial(Load(other)).digest, ours.digest);
}

TEST(Plugins, AreSavedAndReadAgainWithTheirScenario) {
  const Scenario scenario =
      Load({"control.use=copied", "control.copied.yaw_v=3", "trial.duration_s=3"});
  const std::string text = SaveScenario(scenario);
  EXPECT_THAT(text, HasSubstr("use: copied"));
  const Scenario again = ParseScenario(text, "resolved.yaml", Ours());
  EXPECT_EQ(SaveScenario(again), text);
  EXPECT_EQ(RunTrial(again).digest, RunTrial(scenario).digest);
  // a program without them says so
  EXPECT_THAT(
      MessageOf([&] { ParseScenario(text, "resolved.yaml"); }),
      MatchesRegex("resolved.yaml:[0-9]+: control.use = 'copied', must be one of p_voltage, "
                   "pid, lqg, playback; the program that wrote it .turbidock-ros .* has it"));
  const Scenario other = Load({"estimator.use=wrapped"});
  EXPECT_THAT(MessageOf([&] { ParseScenario(SaveScenario(other), "resolved.yaml"); }),
              MatchesRegex("resolved.yaml:[0-9]+: estimator.use = 'wrapped', must be .* has it"));
}

TEST(Plugins, TheirKeysAreAsStrictAsOurs) {
  EXPECT_THAT(MessageOf([] { Load({"control.copied.yaw_w=3"}); }),
              HasSubstr("did you mean yaw_v?"));
  EXPECT_THAT(MessageOf([] { Load({"control.copied.yaw_v=101"}); }),
              HasSubstr("must be in [0, 100]"));
  EXPECT_THAT(MessageOf([] { Load({"control.use=copy"}); }),
              HasSubstr("must be one of p_voltage, pid, lqg, playback, copied, wrong_law"));
  EXPECT_THAT(MessageOf([] { Load({"estimator.use=rmga"}); }),
              HasSubstr("must be one of rm_ga, blobs, fiducial, wrapped"));
  const auto keys = ScenarioKeys(Ours());
  EXPECT_EQ(std::ranges::count(keys, "control.copied.surge_v_per_m", &config::KeyDoc::key), 1);
  EXPECT_EQ(ScenarioKeys().size() + 18, keys.size());
}

TEST(Plugins, RefusesNamesThatAreTakenOrNone) {
  Plugins plugins = Ours();
  const auto message = [&](const std::string& name) {
    return MessageOf([&] { plugins.AddController<CopiedController>(name); });
  };
  for (const char* name : {"", "My_law", "2nd", "my-law"})
    EXPECT_THAT(message(name), HasSubstr("a name is of small letters")) << name;
  for (const char* name : {"copied", "wrapped", "pid", "playback", "blobs"})
    EXPECT_THAT(message(name), HasSubstr("there is one of this name already")) << name;
  for (const auto& [group, name] :
       {std::pair("estimator", "use"), {"estimator", "hue"}, {"control", "levelling"}})
    EXPECT_EQ(message(name),
              std::string("plug-in '") + name + "': there is a key " + group + "." + name);
  EXPECT_EQ(plugins.controllers(), Ours().controllers());
}

TEST(Plugins, AreValues) {
  Plugins registry = Ours();
  const Scenario one = LoadScenario("pool_active", {"control.copied.yaw_v=7"}, "", registry);
  const Scenario copy = one;
  EXPECT_EQ(config::ValueOf(copy, "control.copied.yaw_v"), "7");
  // what a scenario sets stays with it
  EXPECT_EQ(
      config::ValueOf(LoadScenario("pool_active", {}, "", one.plugins), "control.copied.yaw_v"),
      "2");
}

TEST(Plugins, ALawCanBeChosenAndSetWhileATrialRuns) {
  RunningTrial trial(Load({"trial.duration_s=4"}));
  for (int frame = 0; frame < 60; ++frame) trial.Step();
  trial.Set("control.use=copied");
  trial.Set("control.copied.across_v_per_m=5");
  EXPECT_EQ(trial.settings().controller_name(), "copied");
  while (!trial.ended()) trial.Step();
  EXPECT_EQ(trial.Finish().changes.size(), 2u);
}

std::string ErrorOf(const std::vector<std::string>& assignments, const char* pose_source) {
  const Scenario scenario = LoadScenario(
      "pool_active",
      [&] {
        std::vector<std::string> all = assignments;
        all.push_back(std::string("estimator.pose_source=") + pose_source);
        all.emplace_back("trial.duration_s=1.2");
        all.emplace_back("estimator.true_pose.found_after_s=0");
        all.emplace_back("procedure.found_hold_s=0");
        return all;
      }(),
      "", Ours());
  try {
    RunTrial(scenario);
  } catch (const PluginError& error) {
    return error.what();
  }
  return "";
}

TEST(Plugins, ALawThatFailsIsNamed) {
  const auto error = [](const std::string& wrong) {
    return ErrorOf({"control.use=wrong_law", "control.wrong_law.wrong=" + wrong}, "true_pose");
  };
  EXPECT_EQ(error("nothing"), "");
  EXPECT_EQ(error("throws"), "controller wrong_law, Demand at frame 20: no such gain");
  EXPECT_THAT(error("throws_an_int"), HasSubstr("wrong_law, Demand at frame 20 threw what is no"));
  EXPECT_THAT(error("nan"), HasSubstr("gave a demand that is not finite"));
}

// Though its marker is out of sight at the end, it docks as lqg does.
TEST(Plugins, APredictionBridgesTheLastLeg) {
  Plugins plugins = Ours();
  plugins.AddController<Predicting>("predicting");
  Scenario ours = LoadScenario(
      "sea_night_active",
      {"estimator.pose_source=true_pose", "trial.seed=1", "estimator.true_pose.nearest_m=0.45",
       "procedure.servo_x_m=0.75", "procedure.blind_max_s=8"},
      "", plugins);
  Scenario theirs = ours;
  Resolve({config::ParseAssignment("control.use=predicting")}, &theirs);
  auto& params = theirs.plugins.ParamsOf<Predicting::Params>();
  static_cast<control::LqgParams&>(params) = ours.plugins.ParamsOf<control::LqgParams>();
  const TrialResult result = RunTrial(theirs);
  EXPECT_EQ(result.outcome, Outcome::kSuccess) << result.reason;
  EXPECT_EQ(result.digest, RunTrial(ours).digest);
  params.wrong = true;
  try {
    RunTrial(theirs);
    ADD_FAILURE() << "no error";
  } catch (const PluginError& error) {
    EXPECT_THAT(error.what(),
                ::testing::MatchesRegex("controller predicting, Predict at frame "
                                        "[0-9]+ gave a prediction that is not finite"));
  }
}

TEST(Plugins, WithoutAPredictionThereIsNoLastLeg) {
  Plugins plugins = Ours();
  plugins.AddController<Predicting>("predicting");
  const auto message = [&](const std::string& controller) {
    return MessageOf([&] {
      LoadScenario("pool_active", {"control.use=" + controller, "procedure.blind_max_s=5"}, "",
                   plugins);
    });
  };
  EXPECT_THAT(message("copied"), HasSubstr("procedure.blind_max_s: 5 needs a controller that "
                                           "predicts: lqg, predicting, not copied"));
  EXPECT_EQ(message("predicting"), "no error");
}

TEST(Plugins, ALawMayRefuseAVehicle) {
  Plugins plugins = Ours();
  plugins.AddController<RefusingController>("refusing");
  plugins.AddEstimator(
      "refusing_too", RefusingParams(),
      [](const RefusingParams&, const EstimatorSetup&) -> std::unique_ptr<vision::PoseEstimator> {
        throw ConfigError("the rig has one camera");
      });
  const auto run = [&](const std::vector<std::string>& assignments) {
    try {
      RunTrial(LoadScenario("pool_active", assignments, "", plugins));
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(run({"control.use=refusing", "estimator.pose_source=true_pose"}),
            "the vehicle has no rudder");
  EXPECT_EQ(run({"estimator.use=refusing_too"}), "the rig has one camera");
}

// One line adds it to YAML, to the table of keys and to what a running trial can follow.
TEST(Plugins, OneLineAddsAController) {
  Plugins plugins;
  plugins.AddController<Mine>("mine");
  const Scenario scenario =
      ParseScenario(SaveScenario(LoadScenario("pool_active", {"control.mine.gain=3"}, "", plugins)),
                    "mine.yaml", plugins);
  EXPECT_EQ(scenario.plugins.ParamsOf<Mine::Params>().gain, 3);
  const auto keys = ScenarioKeys(plugins);
  const auto key = std::ranges::find(keys, "control.mine.gain", &config::KeyDoc::key);
  ASSERT_NE(key, keys.end());
  EXPECT_EQ(key->value + ", " + key->range + ": " + key->doc, "10, in [0, 100]: newtons a metre");

  RunningTrial trial(LoadScenario("pool_active",
                                  {"control.use=mine", "estimator.pose_source=true_pose",
                                   "estimator.true_pose.found_after_s=0"},
                                  "", plugins));
  for (int frame = 0; frame < 30; ++frame) trial.Step();
  const double before = trial.log().frames.back().demand.norm();
  trial.Set("control.mine.gain=20");
  trial.Step();
  EXPECT_NEAR(trial.log().frames.back().demand.norm(), 2 * before, 0.2 * before);
  EXPECT_GT(before, 0);
}

TEST(Plugins, AnEstimatorThatFailsIsNamed) {
  const auto error = [](const std::string& wrong) {
    return ErrorOf({"estimator.use=wrapped", "estimator.wrapped.wrong=" + wrong}, "cameras");
  };
  EXPECT_EQ(error("nothing"), "");
  EXPECT_EQ(error("throws"), "estimator wrapped, Update at frame 20: no such gain");
  EXPECT_THAT(error("nan"), HasSubstr("estimator wrapped, Update at frame 20 gave a pose that is"));
  EXPECT_THAT(error("no_rotation"), HasSubstr("gave a quaternion of length 2"));
  EXPECT_THAT(error("fitness"), HasSubstr("gave a fitness of 1.5, must be in [-1, 1]"));
}

TEST(Plugins, TheClassicalEstimatorCanSteer) {
  const TrialResult result =
      RunTrial(LoadScenario("pool_active", {"estimator.use=blobs", "water.milk_ml_m3=0",
                                            "trial.duration_s=1", "trial.seed=3"}));
  EXPECT_EQ(result.estimator, "blobs");
  EXPECT_GT(result.fitness_best, 0.3);
}

}  // namespace
}  // namespace turbidock::trial
