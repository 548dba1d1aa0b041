// Faults of a scenario: as they are read, and as the world applies them.

#include "experiments/trial/faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "experiments/trial/perception.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/world.h"

namespace turbidock::trial {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Refusal(const std::vector<std::string>& assignments) {
  try {
    LoadScenario("sea_night_active", assignments);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Faults, AreReadAsAllOtherKeys) {
  EXPECT_EQ(Refusal({"faults.thrusters=[{thruster: sway, force_factor: 0, begin_s: 6}]"}),
            "accepted");
  EXPECT_THAT(Refusal({"faults.thruster=[]"}), HasSubstr("did you mean thrusters?"));
  EXPECT_THAT(Refusal({"faults.thrusters=[{begin: 1}]"}),
              AllOf(HasSubstr("faults.thrusters[0].begin"), HasSubstr("did you mean begin_s?")));
  EXPECT_THAT(Refusal({"faults.images=[{kind: frosen}]"}),
              HasSubstr("one of frozen, black, swapped, late"));
  EXPECT_THAT(Refusal({"faults.thrusters=[{force_factor: -2}]"}), HasSubstr("must be in [-1, 1]"));
  EXPECT_THAT(Refusal({"faults.blurs=[{begin_s: 5, end_s: 5}]"}),
              AllOf(HasSubstr("faults.blurs[0].end_s"), HasSubstr("must be after begin_s")));
  EXPECT_THAT(Refusal({"faults.lights=[{light: yellow}]"}),
              AllOf(HasSubstr("faults.lights[0].light"), HasSubstr("lamp_left, lamp_right, red")));
  EXPECT_THAT(
      Refusal({"faults.fish=[{}, {shines_as: nope}]"}),
      HasSubstr("faults.fish[1].shines_as: 'nope' must be empty or one of red, green, blue"));
  EXPECT_THAT(Refusal({"estimator.pose_source=true_pose", "faults.images=[{kind: black}]"}),
              AllOf(HasSubstr("faults"), HasSubstr("only thrusters can fail")));
  EXPECT_EQ(Refusal({"estimator.pose_source=true_pose", "faults.thrusters=[{thruster: heave}]"}),
            "accepted");
}

// What is too bright is named by who makes it so, before the trial.
TEST(Faults, OfOneLightStayWithinItsRangeTogether) {
  const std::string lamp = "{light: lamp_left, factor: 5}", red = "{light: red, factor: 5}";
  EXPECT_THAT(Refusal({"faults.lights=[" + lamp + ", " + red + ", " + red + "]"}),
              AllOf(HasSubstr("faults.lights[1].factor: makes 'red' too bright, with all that acts "
                              "on it from 0 s on: lights.marker.balls[0].current_factor: "),
                    HasSubstr("must be in [0, 20]")));
  EXPECT_THAT(Refusal({"faults.lights=[" + red +
                       ", {light: red, factor: 5, begin_s: 4, "
                       "flicker_hz: 3}]"}),
              HasSubstr("faults.lights[1].factor: makes 'red' too bright, with all that acts on it "
                        "from 4 s on"));
  EXPECT_EQ(Refusal({"faults.lights=[{light: red, factor: 5, end_s: 4}, {light: red, factor: 5, "
                     "begin_s: 4}, {light: blue, factor: 5}]"}),
            "accepted");
  EXPECT_EQ(Refusal({"faults.lights=[" + red + ", " + red + ", {light: red}]"}), "accepted");
}

TEST(Faults, AreInTheResolvedScenario) {
  const Scenario scenario =
      LoadScenario("sea_night_active",
                   {"faults.images=[{kind: late, camera: right, late_images: 7, begin_s: 3}]",
                    "faults.fish=[{shines_as: red}]"});
  const std::string saved = SaveScenario(scenario);
  EXPECT_THAT(saved, HasSubstr("late_images: 7"));
  const Scenario again = ParseScenario(saved, "saved");
  ASSERT_EQ(again.faults.images.size(), 1U);
  EXPECT_EQ(again.faults.images[0].camera, FaultyCamera::kRight);
  EXPECT_EQ(again.faults.images[0].begin_s, 3);
  EXPECT_EQ(again.faults.distractors.fish.at(0).shines_as, "red");
  EXPECT_EQ(SaveScenario(again), saved);
}

constexpr double kFrame_s = 1.0 / 30;

// Images of a vehicle that drifts before the marker, one a frame, from the start.
std::vector<StereoImage> Film(const std::vector<std::string>& faults, int frames,
                              const std::optional<StereoRegion>& region = std::nullopt) {
  std::vector<std::string> assignments = {"trial.seed=3", "cameras.rig.width_px=160",
                                          "cameras.rig.height_px=120"};
  assignments.insert(assignments.end(), faults.begin(), faults.end());
  World world(LoadScenario("sea_night_passive", assignments), {});
  std::vector<StereoImage> film;
  for (int frame = 0; frame < frames; ++frame) {
    Snapshot snapshot;
    world.Capture(&snapshot);
    EXPECT_NEAR(snapshot.time_s, frame * kFrame_s, 1e-9);
    world.RenderImages(snapshot, frame, region, nullptr, &film.emplace_back());
    vehicle::ContactReport contacts;
    EXPECT_FALSE(world.Advance({}, &contacts));
  }
  return film;
}

std::string From(double frames) { return FormatNumber((frames - 0.5) * kFrame_s); }

TEST(WorldFaults, AFrozenCameraGivesTheImageBefore) {
  const auto sound = Film({}, 6);
  const auto frozen = Film({"faults.images=[{kind: frozen, camera: left, begin_s: " + From(3) +
                            ", end_s: " + From(5) + "}]"},
                           6);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(frozen[i].left, sound[i == 3 || i == 4 ? 2 : i].left) << i;
    EXPECT_EQ(frozen[i].right, sound[i].right) << i;
  }
  EXPECT_NE(sound[2].left, sound[3].left);
}

// A camera with noise never gives the same image twice; of one without nothing can be told.
TEST(EyesFaults, SeeNothingInWhatRepeats) {
  for (const bool noisy : {true, false}) {
    std::vector<std::string> assignments = {
        "trial.seed=3", "cameras.rig.width_px=160", "cameras.rig.height_px=120",
        "cameras.delay_frames=0",
        "faults.images=[{kind: frozen, camera: left, begin_s: " + From(3) + ", end_s: " + From(5) +
            "}]"};
    if (!noisy)
      assignments.insert(assignments.end(),
                         {"cameras.sensor.read_noise_electrons=0",
                          "cameras.sensor.shot_noise=false", "cameras.sensor.video_noise_dn=0"});
    const Scenario scenario = LoadScenario("sea_night_passive", assignments);
    World world(scenario, {});
    Perception perception(scenario, {}, &world);
    const Image3u8 black(160, 120);
    for (int frame = 0; frame < 6; ++frame) {
      ASSERT_TRUE(perception.Update(frame));
      const bool still = noisy && (frame == 3 || frame == 4);
      EXPECT_EQ(perception.latest_images().left == black, still) << frame;
      EXPECT_NE(perception.latest_images().right, black) << frame;
      EXPECT_EQ(perception.latest_images().frame, frame);
      EXPECT_EQ(perception.RepeatRemark(),
                !still       ? ""
                : frame == 3 ? "; the left camera has given the same image for 0.0 s"
                             : "; the left camera has given the same image for 0.1 s");
      vehicle::ContactReport contacts;
      EXPECT_FALSE(world.Advance({}, &contacts));
    }
    EXPECT_EQ(perception.repeated_images(), noisy ? 2 : 0);
  }
}

// A camera whose faults need all of the image is whole wherever it is looked at.
TEST(WorldFaults, ImagesAreWholeWhereFaultsNeedThem) {
  const StereoRegion small = {{10, 10, 20, 20}, {}};
  const std::vector<std::string> late = {"faults.images=[{kind: late, late_images: 2}]"};
  const auto whole = Film(late, 4), part = Film(late, 4, small);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(whole[i].right, part[i].right) << i;
}

// Each of the other faults: nothing before it begins, something then, the same in a region.
TEST(WorldFaults, BeginWhenTheySayAndAreTheSameInARegion) {
  const StereoRegion region = {{40, 30, 120, 90}, {30, 20, 110, 100}};
  const auto sound = Film({}, 4);
  const std::string when = "begin_s: " + From(2) + "}]";
  int tried = 0;
  for (const std::string fault :
       {"misalignments=[{camera: both, ", "dirt=[{radius: 0.4, ", "blurs=[{sigma_px: 2, ",
        "lights=[{light: lamp_left, ", "ambient_light=[{rise_s: 0.01, ", "screens=[{",
        "fish=[{p_MQ_m: [-0.2, 0, 0], ", "second_markers=[{p_MQ_m: [-0.1, 0.1, 0], ",
        "mirrors=[{surface_above_m: 0.1, ", "bubbles=[{radius_m: 0.02, "}) {
    const std::vector<std::string> faults = {"faults." + fault + when};
    const auto whole = Film(faults, 4), part = Film(faults, 4, region);
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(whole[i].left == sound[i].left, i < 2) << fault << i;
      int wrong = 0;
      for (const Side side : kSides)
        for (int v = region[side].row_begin; v < region[side].row_end; ++v)
          for (int u = region[side].column_begin; u < region[side].column_end; ++u)
            for (int k = 0; k < 3; ++k)
              wrong += part[i][side].at(u, v)[k] != whole[i][side].at(u, v)[k];
      EXPECT_EQ(wrong, 0) << fault << i;
    }
    ++tried;
  }
  EXPECT_EQ(tried, 10);
}

// A dead left lamp leaves the view of a world that has only the right one; over, all is as before.
TEST(WorldFaults, EndWhenTheySay) {
  const auto sound = Film({}, 4);
  const auto flickering = Film({"faults.lights=[{light: lamp_left, end_s: " + From(2) +
                                    "}, {light: lamp_right, end_s: " + From(1) + "}]",
                                "faults.misalignments=[{camera: right, end_s: " + From(3) + "}]"},
                               4);
  EXPECT_NE(flickering[0].left, flickering[1].left);
  EXPECT_NE(flickering[1].left, sound[1].left);
  EXPECT_EQ(flickering[2].left, sound[2].left);
  EXPECT_NE(flickering[2].right, sound[2].right);
  EXPECT_EQ(flickering[3].left, sound[3].left);
  EXPECT_EQ(flickering[3].right, sound[3].right);
}

}  // namespace
}  // namespace turbidock::trial
