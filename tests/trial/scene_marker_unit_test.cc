// The estimator's marker is the scene's, unless it is given.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/base/random.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"
#include "vision/fiducial_marker.h"

namespace turbidock::trial {
namespace {

using ::testing::HasSubstr;
using turbidock::testing::MessageOf;
namespace fs = std::filesystem;

// A scene of a user's: the pool with a marker of one's own.
class OwnMarker : public testing::OwnFolder {
 protected:
  // Loads pool_active with the marker's balls written like this, in a box of 80 mm.
  Scenario Load(const std::string& balls, std::vector<std::string> assignments = {}) const {
    std::ofstream(folder_ / "marker.xml")
        << "<mujoco><body name=\"marker\"><site name=\"marker\"/>"
           "<geom name=\"marker_box\" type=\"box\" size=\"0.04 0.04 0.04\"/>"
        << balls << "</body></mujoco>";
    std::ifstream bundled(config::ModelPath("pool_active.xml"));
    std::ostringstream text;
    text << bundled.rdbuf();
    std::string scene = text.str();
    const std::string from = "marker_active.xml";
    scene.replace(scene.find(from), from.size(), "marker.xml");
    std::ofstream(folder_ / "scene.xml") << scene;
    assignments.push_back("trial.scene=" + (folder_ / "scene.xml").string());
    return LoadScenario("pool_active", assignments);
  }
  static std::string Ball(const std::string& name, const std::string& pos,
                          const std::string& rgba) {
    return "<geom name=\"ball_" + name + "\" type=\"sphere\" size=\"0.025\" pos=\"" + pos +
           "\" rgba=\"" + rgba + " 1\"/>";
  }
  const std::string three_ = Ball("green", "-0.065 0 0", "0 1 0") +
                             Ball("yellow", "0 0.065 0", "0.4 0.4 0") +
                             Ball("blue", "0 -0.065 0", "0 0 1");
};

TEST_F(OwnMarker, IsKnownAsTheSceneHasIt) {
  const Scenario scenario = Load(three_);
  const auto& balls = scenario.marker.balls;
  ASSERT_EQ(balls.size(), 3u);
  EXPECT_EQ(balls[0].name, "green");
  EXPECT_EQ(balls[0].p_MQ_m, Eigen::Vector3d(-0.065, 0, 0));  // exactly
  EXPECT_EQ(balls[0].radius_m, 0.025);
  EXPECT_EQ(balls[0].hue_rad, vision::MarkerParams{}.balls[0].hue_rad);  // known by its name
  EXPECT_EQ(balls[1].name, "yellow");
  EXPECT_NEAR(balls[1].hue_rad, std::numbers::pi / 3, 1e-6);
  EXPECT_EQ(balls[1].display_rgb, (std::array<double, 3>{1, 1, 0}));
  EXPECT_EQ(scenario.marker.box_m, Eigen::Vector3d::Constant(0.08));
  // what is saved says so, and is the same trial
  const Scenario again = ParseScenario(SaveScenario(scenario), "resolved.yaml");
  EXPECT_EQ(SaveScenario(again), SaveScenario(scenario));
}

TEST_F(OwnMarker, IsNotTakenWhereTheScenarioGivesOne) {
  const std::string given = "marker.balls=[{name: green, p_MQ_m: [-0.07, 0, 0]}]";
  const Scenario scenario = Load(three_, {given, "trial.duration_s=0.03"});
  ASSERT_EQ(scenario.marker.balls.size(), 1u);
  EXPECT_EQ(scenario.marker.balls[0].p_MQ_m.x(), -0.07);
  EXPECT_THAT(MessageOf([&] { RunTrial(scenario); }),
              HasSubstr("ball green is known at [-0.07, 0, 0] m"));
}

TEST_F(OwnMarker, NeedsBallsThatCanBeToldApart) {
  EXPECT_THAT(MessageOf([&] {
                Load(Ball("red", "0 0 0.065", "1 0 0") + Ball("crimson", "0 0.065 0", "1 0 0.1"));
              }),
              HasSubstr("lights.marker.balls: has no light for crimson, which is known by its "
                        "paint: balls red and crimson cannot be told apart: their hues "
                        "differ by 6°"));
  EXPECT_THAT(MessageOf([&] { Load(Ball("pale", "0 0 0.065", "0.5 0.5 0.5")); }),
              HasSubstr("ball pale of the scene is grey"));
}

// A plan sets its trials' values over a scenario that is loaded already, --set while one is loaded.
TEST_F(OwnMarker, IsTheSameHoweverTheStepsAreDivided) {
  Load(three_);  // writes the files
  const std::string own = "trial.scene=" + (folder_ / "scene.xml").string();
  const std::vector<std::string> steps = {own,
                                          "trial.scene=pool_active.xml",
                                          "marker.from_scene=true",
                                          "marker.from_scene=false",
                                          "marker.balls[0].radius_m=0.021",
                                          "marker.balls=[{name: green, p_MQ_m: [-0.07, 0, 0]}]",
                                          "marker.box_m=[0.11, 0.1, 0.09]",
                                          "marker={box_m: [0.12, 0.1, 0.09]}",
                                          "lights.marker.enabled=false",
                                          "lights.marker.balls[2].color=[0.05, 0.2, 1]",
                                          "cameras.optics=published"};
  Rng rng = SeedTree(3).Stream("steps");
  int compared = 0;
  for (int draw = 0; draw < 300; ++draw) {
    std::vector<std::string> drawn;
    for (int i = 0; i < 4; ++i) drawn.push_back(steps[rng.NextU64() % steps.size()]);
    const auto given = config::ParseAssignments(drawn);
    Scenario in_steps = LoadScenario("pool_active", {});
    try {
      for (const config::Assignment& step : given) Resolve({step}, &in_steps);
    } catch (const ConfigError&) {  // such as a scene without tags
      continue;
    }
    Scenario at_once = LoadScenario("pool_active", {});
    Resolve(given, &at_once);
    EXPECT_EQ(SaveScenario(at_once), SaveScenario(in_steps))
        << fmt::format("{}", fmt::join(drawn, " "));
    EXPECT_EQ(SaveScenario(LoadScenario("pool_active", drawn)), SaveScenario(in_steps));
    ++compared;
  }
  EXPECT_GT(compared, 150);
}

TEST_F(OwnMarker, IsWhatIsGivenOverWhatIsTaken) {
  const Scenario bundled = LoadScenario("pool_active", {});
  const Scenario smaller = Load(three_, {});
  const std::string own = "trial.scene=" + (folder_ / "scene.xml").string();
  const auto load = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = {own};
    all.insert(all.end(), more.begin(), more.end());
    return LoadScenario("pool_active", all);
  };
  const Scenario one = load({"marker.balls[1].radius_m=0.021"});
  EXPECT_EQ(one.marker.balls[1].name, "yellow");
  EXPECT_EQ(one.marker.balls[1].radius_m, 0.021);
  EXPECT_EQ(one.marker.balls[0].radius_m, 0.025);
  const Scenario box = load({"marker.box_m=[0.11, 0.1, 0.09]"});
  EXPECT_EQ(box.marker.box_m.x(), 0.11);
  EXPECT_EQ(box.marker.balls.size(), 3u);
  EXPECT_EQ(SaveScenario(load({"trial.scene=pool_active.xml"})), SaveScenario(bundled));
  EXPECT_EQ(load({"marker.from_scene=false"}).marker.balls[1].name, bundled.marker.balls[1].name);
  // A resolved scenario with a ball that was edited.
  std::string text = SaveScenario(smaller);
  const size_t at = text.find("radius_m: 0.025");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 15, "radius_m: 0.022");
  const std::string file = (folder_ / "resolved.yaml").string();
  std::ofstream(file) << text;
  EXPECT_EQ(LoadScenario(file, {}).marker.balls[0].radius_m, 0.022);
}

// An own scene with an own vehicle and its data beside it does not fly with the bundled data.
TEST_F(OwnMarker, AndItsVehicleHaveTheirOwnData) {
  const std::string own = "trial.scene=" + (folder_ / "scene.xml").string();
  Load(three_);
  fs::copy_file(config::ModelPath("vehicle.xml"), folder_ / "vehicle.xml");
  EXPECT_EQ(MessageOf([&] { LoadScenario("pool_active", {own}); }), "no error");
  std::ifstream bundled(config::ModelPath("vehicle.yaml"));
  std::ostringstream data;
  data << bundled.rdbuf();
  std::ofstream(folder_ / "vehicle.yaml") << data.str();
  EXPECT_EQ(MessageOf([&] { LoadScenario("pool_active", {own}); }), "no error");
  std::ofstream(folder_ / "vehicle.yaml", std::ios::app) << "# my own\n";
  EXPECT_THAT(
      MessageOf([&] { LoadScenario("pool_active", {own}); }),
      HasSubstr(
          "has a vehicle.xml beside it with data of its own: say vehicle.model: ./vehicle.xml"));
  const Scenario named =
      LoadScenario("pool_active", {own, "vehicle.model=" + (folder_ / "vehicle.xml").string()});
  for (const ModelFile& file : ModelFilesOf(named))
    EXPECT_TRUE(file.file != "vehicle.xml" && file.file != "vehicle.yaml") << file.file;
}

TEST(SceneTags, AreTakenAndMustBeThere) {
  const std::vector<std::string> reads = {"estimator.use=fiducial", "trial.duration_s=0.03"};
  EXPECT_THAT(MessageOf([&] { LoadScenario("sea_night_passive", reads); }),
              HasSubstr("estimator.fiducial.tags: there is no tag to read in sea_passive.xml"));
  const auto tags_of = [](auto& of) -> auto& {
    return of.plugins.template ParamsOf<vision::FiducialParams>().tags;
  };
  const Scenario without = LoadScenario("sea_night_passive", {});
  EXPECT_TRUE(tags_of(without).empty());

  Scenario scenario = LoadScenario("sea_night_fiducial", reads);
  auto& tags = tags_of(scenario);
  ASSERT_EQ(tags.size(), 2u);
  EXPECT_EQ(tags[0].p_MT_m, Eigen::Vector3d(0.105, 0.155, -0.06));
  EXPECT_EQ(tags[0].size_m, 0.066);
  const auto refusal = [](Scenario changed) { return MessageOf([&] { RunTrial(changed); }); };
  EXPECT_EQ(refusal(scenario), "no error");
  auto& family = scenario.plugins.ParamsOf<vision::FiducialParams>().family;
  family = vision::TagFamily::k36h11;
  EXPECT_THAT(refusal(scenario), HasSubstr("tag 0 of the scene is one of 16h5"));
  family = vision::TagFamily::k16h5;
  tags[1].p_MT_m.z() += 0.002;
  EXPECT_THAT(refusal(scenario), HasSubstr("tag 1 is known at [0.105, -0.155, 0.082] m"));
  tags[1].p_MT_m.z() -= 0.002;
  tags[1].q_MT_wxyz = {0, 1, 0, 0};  // upside down
  EXPECT_THAT(refusal(scenario), HasSubstr("tag 1 is turned by 3.1 rad"));
  tags[1].id = 5;
  EXPECT_THAT(refusal(scenario), HasSubstr("tag 5 is not in the scene (sea_fiducial.xml)"));
  scenario.marker_may_differ = true;
  EXPECT_EQ(refusal(scenario), "no error");
}

}  // namespace
}  // namespace turbidock::trial
