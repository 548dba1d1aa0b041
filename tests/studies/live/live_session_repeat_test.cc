// What a person does to a trial, without a server.

#include "experiments/studies/live/live_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/trial/trial.h"
#include "tests/support/message_of.h"

namespace turbidock::live {
namespace {

using ::testing::HasSubstr;

trial::Scenario Short(std::vector<std::string> assignments = {}) {
  assignments.insert(assignments.begin(), {"trial.duration_s=1", "trial.seed=11"});
  return trial::LoadScenario("sea_night_active", assignments);
}

std::string ProblemOf(LiveSession* session, const std::string& command) {
  return testing::MessageOf([&] { session->Handle(command); });
}

void Finish(LiveSession* session) {
  session->Handle(R"({"do": "go"})");
  while (session->wants_step()) session->Step(false);
}

TEST(LiveSession, APausedTrialThatGoesOnEndsAsOneThatWasNeverWatched) {
  const trial::TrialResult alone = trial::RunTrial(Short());
  LiveSession session(Short());
  for (int i = 0; i < 7; ++i) session.Step(i % 2 == 0);
  session.Handle(R"({"do": "pause"})");
  EXPECT_FALSE(session.wants_step());
  session.Handle(R"({"do": "step"})");
  EXPECT_TRUE(session.wants_step());
  session.Step(true);
  EXPECT_FALSE(session.wants_step());
  EXPECT_EQ(session.latest_images().left.width(), 640);
  for (int i = 0; i < 3; ++i) session.Handle(R"({"do": "step"})");
  for (int i = 0; i < 3; ++i) session.Step(true);
  EXPECT_FALSE(session.wants_step());
  session.Handle(R"({"do": "speed", "factor": 4})");
  EXPECT_EQ(session.speed(), 4);
  Finish(&session);
  ASSERT_TRUE(session.result());
  EXPECT_EQ(session.result()->digest, alone.digest);
  EXPECT_TRUE(session.result()->changes.empty());
}

TEST(LiveSession, WithASliderMovedTheRecordSaysSo) {
  std::optional<trial::TrialResult> recorded;
  LiveSession session(Short(), [&](const trial::Scenario& began, const trial::TrialResult& result) {
    EXPECT_EQ(began.light.water.milk_ml_m3, 0);
    recorded = result;
  });
  for (int i = 0; i < 6; ++i) session.Step(false);
  session.Handle(R"({"do": "set", "key": "water.milk_ml_m3", "value": 30})");
  session.Handle(
      R"({"do": "set", "key": "lights.lamps.intensity_w_sr", "value": [0.1, 0.1, 0.1]})");
  session.Handle(R"({"do": "set", "key": "sea.state", "value": "rough"})");
  session.Handle(R"({"do": "push", "force_newton": [0, 3, 0]})");
  Finish(&session);
  ASSERT_TRUE(recorded);
  EXPECT_NE(recorded->digest, trial::RunTrial(Short()).digest);
  const std::vector<trial::Change> expected = {
      {6, 0.2, "water.milk_ml_m3", "30"},
      {6, 0.2, "lights.lamps.intensity_w_sr", "[0.1,0.1,0.1]"},
      {6, 0.2, "sea.state", "rough"},
      {6, 0.2, "push", "[0, 3, 0]"}};
  EXPECT_EQ(recorded->changes, expected);
  EXPECT_EQ(session.settings().light.water.milk_ml_m3, 30);
}

TEST(LiveSession, RestartsWithAnotherSeedAndTheSettingsAsTheyStand) {
  std::vector<std::string> ends;
  LiveSession session(Short(), [&](const trial::Scenario&, const trial::TrialResult& result) {
    ends.emplace_back(NameOf(result.outcome));
  });
  session.Handle(R"({"do": "restart", "seed": 12})");
  EXPECT_TRUE(ends.empty()) << "there was no frame yet";
  EXPECT_EQ(session.trial_number(), 2);
  session.Step(false);
  session.Handle(R"({"do": "set", "key": "water.milk_ml_m3", "value": 10})");
  session.Handle(R"({"do": "restart", "seed": "13"})");
  EXPECT_EQ(ends, std::vector<std::string>{"interrupted"});
  EXPECT_TRUE(session.log().frames.empty());
  EXPECT_TRUE(session.changes().empty());
  Finish(&session);
  EXPECT_EQ(session.result()->seed, 13);
  EXPECT_EQ(session.result()->digest,
            trial::RunTrial(Short({"trial.seed=13", "water.milk_ml_m3=10"})).digest);
  // after the end, too: with the same seed, and what was set meanwhile
  session.Handle(R"({"do": "set", "key": "water.milk_ml_m3", "value": 0})");
  for (const char* command : {R"({"do": "push", "force_newton": [1, 0, 0]})", R"({"do": "step"})"})
    EXPECT_THAT(ProblemOf(&session, command), HasSubstr("the trial has ended"));
  session.Handle(R"({"do": "restart"})");
  Finish(&session);
  EXPECT_EQ(session.result()->digest, trial::RunTrial(Short({"trial.seed=13"})).digest);
}

TEST(LiveSession, RefusesWhatIsNoCommandAndGoesOn) {
  LiveSession session(Short());
  session.Step(false);
  for (const auto& [command, problem] : std::vector<std::pair<std::string, std::string>>{
           {"", "parse error"},
           {"[]", "must be a JSON object"},
           {"{}", "has no \"do\""},
           {R"({"do": 3})", "must be text"},
           {R"({"do": "explode"})", "must be one of"},
           {R"({"do": "speed"})", "has no \"factor\""},
           {R"({"do": "speed", "factor": 0})", "from 0.05 to 100"},
           {R"({"do": "speed", "factor": "fast"})", "from 0.05 to 100"},
           {R"({"do": "restart", "seed": -1})", "must be >= 0"},
           {R"({"do": "restart", "seed": 1.5})", "whole number"},
           {R"({"do": "restart", "seed": "x"})", "whole number"},
           {R"({"do": "set", "key": "water.milk_ml_m3"})", "has no \"value\""},
           {R"({"do": "set", "key": "water.milk_ml_m3", "value": {}})", "must be a value"},
           {R"({"do": "set", "key": "water.milk_ml_m3", "value": 1e9})", "must be in"},
           {R"({"do": "set", "key": "water.milk_ml_m3", "value": "<b>"})", "must be a number"},
           {R"({"do": "set", "key": "seed", "value": 2})", "cannot change"},
           {R"({"do": "set", "key": "model", "value": "/etc/passwd"})", "cannot change"},
           {R"({"do": "push", "force_newton": [1, 2]})", "must be 3 numbers"},
           {R"({"do": "push", "force_newton": [100, 0, 0]})", "at most 50 N"},
           {R"({"do": "push", "force_newton": [1, null, 0]})", "must be 3 numbers"}})
    EXPECT_THAT(ProblemOf(&session, command), HasSubstr(problem)) << command;
  EXPECT_TRUE(session.changes().empty());
  EXPECT_EQ(session.speed(), 1);
  EXPECT_TRUE(session.going());
  Finish(&session);
  EXPECT_EQ(session.result()->digest, trial::RunTrial(Short()).digest);
}

TEST(LiveSession, WhatThePageOffersCanBeSet) {
  for (const char* law : {"p_voltage", "pid", "lqg"}) {
    LiveSession session(Short({std::string("control.use=") + law}));
    const report::Json controls = ControlsModel(session.settings());
    EXPECT_GT(controls.size(), 12u);
    for (const report::Json& control : controls) {
      SCOPED_TRACE(control["key"]);
      EXPECT_EQ(control["label"].get<std::string>().find_first_of("_."), std::string::npos);
      std::vector<report::Json> values;
      if (control.contains("choices"))
        values = {control["choices"].begin(), control["choices"].end()};
      else
        values = {control["low"], control["high"]};
      EXPECT_GE(values.size(), 2u);
      for (report::Json value : values) {
        if (control.contains("list_of")) value = {value, value, value};
        // only asked about: it changes what is offered
        if (control["key"] == "control.use") {
          EXPECT_NO_THROW(
              trial::Changed(session.settings(), "control.use=" + value.get<std::string>()));
          continue;
        }
        EXPECT_EQ(
            ProblemOf(&session,
                      report::JsonLine({{"do", "set"}, {"key", control["key"]}, {"value", value}})),
            "no error");
      }
      if (!control.contains("choices")) {
        EXPECT_GE(control["value"], control["low"]);
        EXPECT_LE(control["value"], control["high"]);
      }
    }
    session.Step(false);
    EXPECT_FALSE(session.changes().empty());
  }
}

}  // namespace
}  // namespace turbidock::live
