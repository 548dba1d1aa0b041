// What a trial's report says and draws, of trials that are made up or awkward.

#include "experiments/trial/trial_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "experiments/media/figure.h"
#include "experiments/media/png.h"
#include "experiments/trial/trace_panels.h"
#include "experiments/trial/trial.h"
#include "sim/base/units.h"
#include "tests/studies/run/synthetic_trial.h"

namespace turbidock::trial {
namespace {

using control::Stage;
using report::Panel;
using report::Sample;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Field;

constexpr double kMm = 1000;

std::string Path(const std::string& name) { return ::testing::TempDir() + "/" + name; }

const report::Series& Curve(const Panel& panel, const std::string& name) {
  return *std::ranges::find(panel.series, name, &report::Series::name);
}

Panel PanelOf(const TrialLog& log, Trace trace, const ViewCriteria& criteria = {}) {
  return TracePanels(Series::Of(log), criteria)[static_cast<size_t>(trace)];
}

// The marker holds still at y = 40 mm, the edge of docking's band about the desired 0; nothing is
// detected, and the estimates are far off.
TrialLog OnTheEdge(Stage stage = Stage::kDocking) {
  TrialLog log;
  for (int k = 0; k < 60; ++k) {
    FrameRecord f;
    f.frame = k;
    f.time_s = k / 30.0;
    f.image_time_s = std::max(0.0, f.time_s - 0.1);
    f.stage = stage;
    f.controlled = true;
    f.fitness = 0;
    f.true_X_HM.p = {0.6, 0.040, -0.040};
    f.est_X_HM.p = {5, 5, 5};
    f.desired = {0.6, 0, 0, 0};
    log.frames.push_back(f);
  }
  return log;
}

TEST(TracePanels, TruthOnTheEdgeOfTheBandIsDrawnThere) {
  for (const auto& [trace, sign] : {std::pair{Trace::kY, 1}, {Trace::kZ, -1}}) {
    const Panel panel = PanelOf(OnTheEdge(), trace);
    EXPECT_THAT(Curve(panel, "truth").points, Each(Field(&Sample::y, 40 * sign)));
    EXPECT_THAT(Curve(panel, "allowed").points,
                Each(AllOf(Field(&Sample::low, -40), Field(&Sample::high, 40))));
  }
}

// y and z have limits of their own, and servoing must be closer than docking may be.
TEST(TracePanels, BandsAreTheirOwnAndThoseOfTheStage) {
  const auto band = [](Trace trace, Stage stage) {
    const ViewCriteria criteria{.tolerance_z_m = 0.020, .enter_y_m = 0.01, .enter_z_m = 0.005};
    return Curve(PanelOf(OnTheEdge(stage), trace, criteria), "allowed").points[0].high;
  };
  EXPECT_EQ(band(Trace::kY, Stage::kDocking), 40);
  EXPECT_EQ(band(Trace::kZ, Stage::kDocking), 20);
  EXPECT_EQ(band(Trace::kY, Stage::kVisualServoing), 10);
  EXPECT_EQ(band(Trace::kZ, Stage::kDocked), 20);
  EXPECT_EQ(band(Trace::kZ, Stage::kVisualServoing), 5);
  EXPECT_TRUE(std::isnan(band(Trace::kY, Stage::kApproach)));
  EXPECT_TRUE(std::isnan(band(Trace::kX, Stage::kDocking)));
}

TEST(TracePanels, WhatIsNotDetectedStandsApartAtItsImagesTime) {
  TrialLog log = OnTheEdge();
  for (size_t k = 30; k < 60; ++k) {
    log.frames[k].fitness = 0.8;
    log.frames[k].est_X_HM.p.y() = 0.07;
  }
  const Panel panel = PanelOf(log, Trace::kY);
  const auto &lost = Curve(panel, "F too low").points, &seen = Curve(panel, "estimate").points;
  for (size_t k = 0; k < 60; ++k) {
    EXPECT_EQ(std::isnan(lost[k].y), k >= 30);
    EXPECT_EQ(std::isnan(seen[k].y), k < 30);
    EXPECT_EQ(seen[k].x, log.frames[k].image_time_s);
  }
  EXPECT_EQ(lost[0].y, 5000);
  EXPECT_EQ(seen[59].y, 0.07 * kMm);
  // what counts is in the axis, what does not is not
  EXPECT_LT(panel.y.low, -40);
  EXPECT_GT(panel.y.high, 70);
  EXPECT_LT(panel.y.high, 100);
}

// Where a search begins says nothing of where it is.
TEST(TracePanels, TheFirstSecondOfASearchSetsNoScale) {
  TrialLog log = OnTheEdge();
  log.frames[3].fitness = log.frames[40].fitness = 0.9;
  log.frames[40].est_X_HM.p.y() = 0.3;
  const Panel panel = PanelOf(log, Trace::kY);
  EXPECT_EQ(Curve(panel, "estimate").points[3].y, 5000);
  EXPECT_GT(panel.y.high, 300);
  EXPECT_LT(panel.y.high, 400);
}

TEST(TracePanels, DesiredIsDrawnOnlyWhileItIsFollowed) {
  TrialLog log = OnTheEdge();
  for (size_t k = 0; k < 30; ++k) log.frames[k].controlled = false;
  for (const Trace trace : {Trace::kX, Trace::kYaw}) {
    const Panel panel = PanelOf(log, trace);
    const auto& desired = Curve(panel, "desired").points;
    EXPECT_TRUE(std::isnan(desired[29].y));
    EXPECT_EQ(desired[30].y, trace == Trace::kX ? 600 : 0);
  }
}

TEST(TracePanels, YawIsInDegreesByTheQuaternion) {
  TrialLog log = OnTheEdge();
  for (FrameRecord& frame : log.frames) frame.true_X_HM.q = FromYawPitchRoll(-0.3, 0.2, 0.1);
  EXPECT_NEAR(Curve(PanelOf(log, Trace::kYaw), "truth").points[9].y, units::DegFromRad(-0.3), 1e-9);
}

// Behind the curves are the stages, each for its time; their names once.
TEST(TracePanels, BlocksAreTheStages) {
  const TrialLog log = testing::SyntheticTrial(36);
  const std::vector<Panel> panels = TracePanels(Series::Of(log), {});
  std::vector<std::string> names;
  for (const report::Block& block : panels[0].blocks) {
    names.push_back(block.name);
    const auto at = static_cast<size_t>(30 * (block.from_x + block.to_x) / 2);
    EXPECT_EQ(report::Words(NameOf(log.frames[at].stage)), block.name);
    EXPECT_EQ(block.color, kOnPaper.Of(log.frames[at].stage));
  }
  EXPECT_THAT(names, ElementsAre("approach", "visual servoing", "docking", "visual servoing",
                                 "docking", "docked"));
  for (size_t i = 1; i < panels.size(); ++i)
    for (const report::Block& block : panels[i].blocks) EXPECT_EQ(block.name, "");
}

// Two routes: the curves of a trial that grew, row by row, are those of the whole one.
TEST(TracePanels, WhatGrewIsTheWhole) {
  const Series series = Series::Of(testing::SyntheticTrial(6));
  const std::vector<Panel> whole = TracePanels(series, {});
  const std::vector<Panel> end = TracePanels(series, {}, {.first_row = 100});
  for (size_t i = 0; i < whole.size(); ++i) {
    if (std::isfinite(whole[i].y.high)) {
      EXPECT_EQ(whole[i].y.high, end[i].y.high) << "the axis is that of all rows";
    }
    for (size_t k = 0; k < whole[i].series.size(); ++k) {
      const auto &all = whole[i].series[k].points, &rest = end[i].series[k].points;
      ASSERT_EQ(rest.size() + 100, all.size());
      for (size_t p = 0; p < rest.size(); ++p) {
        EXPECT_EQ(rest[p].x, all[p + 100].x);
        if (std::isfinite(rest[p].y)) {
          EXPECT_EQ(rest[p].y, all[p + 100].y);
        }
      }
    }
  }
}

report::Json RecordOf(const std::string& outcome) {
  TrialResult result;
  result.reason = "it says so of hull_box";
  result.time_s = 1.5;
  result.insertion_depth_m = 0.1;
  result.inserted = outcome == "success";
  result.stage_time_s[Stage::kDocking] = 2;
  report::Json record = result;
  record["outcome"] = outcome;
  return record;
}

TEST(TrialReport, SaysHowItEnded) {
  for (const auto& [outcome, tone] : {std::pair{"success", report::Tone::kGood},
                                      {"interrupted", report::Tone::kNone},
                                      {"false_dock", report::Tone::kBad}}) {
    const report::Report report = ReportOf({}, RecordOf(outcome), Series::Of(OnTheEdge()));
    EXPECT_EQ(report.verdict.word, report::Words(outcome));
    EXPECT_EQ(report.verdict.tone, tone);
    EXPECT_EQ(report.verdict.reason, "it says so of hull");
  }
}

std::string FigureIn(const report::Report& report, const std::string& key) {
  const auto& facts = report.sections.back().facts;
  const auto at = std::ranges::find(facts, key, &report::Fact::note);
  return at == facts.end() ? "none" : at->value;
}

// Nothing was detected at its end, and it never servoed.
TEST(TrialReport, WhatIsNoiseIsNotSaid) {
  const report::Report lost = ReportOf({}, RecordOf("timeout"), Series::Of(OnTheEdge()));
  for (const char* key : {"final_error_estimated", "tracking_rms_m", "overshoot_m"})
    EXPECT_EQ(FigureIn(lost, key), "-") << key;
  EXPECT_EQ(FigureIn(lost, "insertion_depth_m"), "-") << "the pole is elsewhere";
  EXPECT_EQ(
      FigureIn(ReportOf({}, RecordOf("success"), Series::Of(OnTheEdge())), "insertion_depth_m"),
      "100 mm");
  EXPECT_EQ(FigureIn(lost, "stage_time_s.docking"), "2 s");
  TrialLog seen = OnTheEdge();
  for (FrameRecord& frame : seen.frames) frame.fitness = 0.9;
  report::Json record = RecordOf("timeout");
  record["transitions"] = {
      {{"frame", 15}, {"from", "approach"}, {"to", "visual_servoing"}, {"reason", "found"}}};
  const report::Report report = ReportOf({}, record, Series::Of(seen));
  EXPECT_EQ(FigureIn(report, "final_error_estimated.x_m"), "0 mm");
  EXPECT_EQ(FigureIn(report, "tracking_rms_m"), "0 mm");
  const auto stages = std::ranges::find(report.sections, "Stages", &report::Section::title);
  EXPECT_EQ(stages->table->rows()[0][0].link, "t=0.5");
}

TEST(TrialReport, NoTwoFiguresHaveOneName) {
  const report::Report report = ReportOf({}, RecordOf("success"), Series::Of(OnTheEdge()));
  std::set<std::string> labels;
  for (const report::Fact& fact : report.sections.back().facts)
    EXPECT_TRUE(labels.insert(fact.label).second) << fact.label << " twice";
  EXPECT_GT(labels.size(), 40u);
}

TEST(TrialReport, SettingsAreWhatDiffersAndNothingElse) {
  const auto rows = [](const Scenario& scenario) {
    const report::Report report = ReportOf(scenario, RecordOf("success"), Series::Of(OnTheEdge()));
    std::map<std::string, std::pair<std::string, std::string>> settings;
    const auto at =
        std::ranges::find(report.sections, "Settings that differ", &report::Section::title);
    for (const auto& row : at->table->rows()) settings[row[0].text] = {row[1].text, row[2].text};
    return settings;
  };
  Scenario scenario = LoadScenario("sea_night_active", {"estimator.pose_source=true_pose"});
  const auto before = rows(scenario);
  EXPECT_EQ(before.at("estimator.pose_source").first, "true_pose");
  EXPECT_EQ(before.at("estimator.pose_source").second, "cameras");
  EXPECT_FALSE(before.contains("trial.seed"));
  EXPECT_FALSE(before.contains("vehicle.model")) << "as every scenario has it";
  EXPECT_EQ(rows(LoadScenario("bluerov2_sea_night", {})).at("vehicle.model").first,
            "bluerov2_heavy.xml");
  scenario.plugins.ParamsOf<control::PidParams>().sway.kp_per_s2 += 1;
  const auto after = rows(scenario);
  EXPECT_EQ(after.size(), before.size() + 1);
  EXPECT_TRUE(after.contains("control.pid.sway.kp_per_s2"));
}

TEST(TrialReport, ALogWithoutRowsIsSaid) {
  EXPECT_THAT(ReportOf({}, RecordOf("success"), Series(TrialLog().thrusters)).missing,
              ElementsAre("No curves: the log has no rows."));
}

// Stages as short as a frame, values that are not finite, words that gnuplot could take for its
// own.
TEST(TrialReport, AwkwardTrialsCanBeDrawn) {
  TrialLog restless = testing::SyntheticTrial(3);
  for (size_t k = 0; k < restless.frames.size(); ++k)
    restless.frames[k].stage = EnumNames<Stage>::kNames[k % 4].first;
  restless.frames[40].est_X_HM.p.y() = NAN;
  Scenario scenario;
  scenario.description = "it's 50 % \"milk\" $x `date` @a_b^{c}\ntwo lines \\n";
  const auto draw = [&](const TrialLog& log) {
    const report::Report report = ReportOf(scenario, RecordOf("timeout"), Series::Of(log));
    media::WriteFigure(Path("awkward.png"), media::FigureOf(report));
    const Image3u8 image = media::ReadPng(Path("awkward.png"));
    EXPECT_EQ(image.width(), 1400);
    int blue = 0;
    for (size_t i = 0; i < image.pixels(); ++i)
      blue += image.data()[3 * i + 2] > image.data()[3 * i] + 100;
    return blue;
  };
  EXPECT_GT(draw(restless), 100);
  TrialLog one;
  one.frames.emplace_back();
  draw(one);
}

}  // namespace
}  // namespace turbidock::trial
