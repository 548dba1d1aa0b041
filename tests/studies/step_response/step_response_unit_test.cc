// What the report of step responses says.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "experiments/studies/step_response/step_response.h"
#include "experiments/trial/scenario.h"

namespace turbidock::step_response {
namespace {

// What was asked, of what, and in which unit, is said where it is drawn.
TEST(StepReport, SaysStepPushNoiseAndUnits) {
  const auto report_of = [](const std::string& controller) {
    AxisResponse x{.axis = control::kSurge}, yaw{.axis = control::kYaw};
    x.step.settling_time_s = yaw.step.settling_time_s = 3;
    x.loop.sensitivity_peak = 1.5;
    yaw.loop.sensitivity_peak = 2.1;
    x.step.answer = {.wanted = 0.05, .time_s = {0}, .actual = {0}, .demand = {0}};
    yaw.step.answer = {.wanted = kStep_rad, .time_s = {0}, .actual = {0}, .demand = {0}};
    x.disturbance.answer = yaw.disturbance.answer = {.time_s = {0}, .actual = {0}, .demand = {0}};
    return ReportOf(
        trial::LoadScenario("pool_active",
                            {"estimator.pose_source=true_pose", "control.use=" + controller,
                             "estimator.true_pose.noise=[0.001, 0, 0, 0]"}),
        {x, yaw});
  };
  const report::Report report = report_of("lqg");
  const std::vector<report::Panel>&x = report.sections[1].panels, &yaw = report.sections[2].panels;
  EXPECT_EQ(x[0].title, "x: step of 50 mm");
  EXPECT_EQ(x[0].y.label, "moved from rest, mm");
  EXPECT_EQ(x[0].y2.label, "demand (grey), N");
  EXPECT_EQ(x[1].title, "x: steady push of 1 N");
  EXPECT_EQ(yaw[0].title, "yaw: step of 5°");
  EXPECT_EQ(yaw[0].y2.label, "demand (grey), N m");
  EXPECT_EQ(yaw[1].title, "yaw: steady push of 0.1 N m");
  EXPECT_EQ(report_of("p_voltage").sections[1].panels[0].y2.label, "demand (grey), V");
  EXPECT_EQ(report.verdict.word, "little robust");
  EXPECT_THAT(report.verdict.reason, ::testing::HasSubstr("2.10, on yaw"));
  EXPECT_THAT(report.sections[0].note, ::testing::HasSubstr("with noise of 1 mm and 0°"));
}

TEST(StepReport, SaysFirstWhatIsNotSo) {
  const trial::Scenario scenario = trial::LoadScenario("pool_active", std::vector<std::string>{});
  AxisResponse settled{.axis = control::kSurge}, swings{.axis = control::kSway},
      left{.axis = control::kYaw, .not_measured = "excited in yaw, it left"};
  settled.step = {.answer = {}, .rise_time_s = 1, .settling_time_s = 2};
  swings.step = {.answer = {}, .rise_time_s = 1, .overshoot = 0.55};
  EXPECT_EQ(ReportOf(scenario, {settled}).verdict.word, "robust");
  const report::Report unsettled = ReportOf(scenario, {settled, swings});
  EXPECT_EQ(unsettled.verdict.word, "the step on y does not settle");
  EXPECT_THAT(unsettled.verdict.reason, ::testing::HasSubstr("beyond by 55 %"));
  const report::Report partly = ReportOf(scenario, {settled, swings, left});
  EXPECT_EQ(partly.verdict.word, "yaw could not be measured");
  EXPECT_THAT(partly.sections[0].lines,
              ::testing::ElementsAre("not measured: excited in yaw, it left"));
  EXPECT_EQ(partly.sections.size(), 3u) << "and what was measured";
}

// Through a narrow view the step aside takes the marker out.
TEST(StepResponses, OfAnAxisThatLeavesTheMarkerAreToldAndOthersMeasured) {
  const trial::Scenario narrow = trial::LoadScenario(
      "pool_active", std::vector<std::string>{"estimator.pose_source=true_pose",
                                              "cameras.rig.horizontal_fov_rad=0.3"});
  StepOptions options;
  options.axes = {control::kSurge, control::kSway, control::kHeave};
  options.frequencies_hz = {0.5, 1};
  const std::vector<AxisResponse> responses = MeasureStepResponses(narrow, options);
  ASSERT_EQ(responses.size(), 3u);
  EXPECT_EQ(responses[0].not_measured + responses[2].not_measured, "");
  EXPECT_TRUE(responses[0].step.rise_time_s && responses[2].step.rise_time_s);
  EXPECT_THAT(responses[1].not_measured,
              ::testing::HasSubstr("excited in y, the vehicle loses the marker"));
}

}  // namespace
}  // namespace turbidock::step_response
