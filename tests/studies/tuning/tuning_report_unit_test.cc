// What is said of a tuning run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "experiments/report/report.h"
#include "experiments/report/report_json.h"
#include "experiments/studies/tuning/tuner.h"
#include "tests/studies/tuning/study_text.h"
#include "tests/support/own_folder.h"

namespace turbidock::tuning {
namespace {

using ::testing::HasSubstr;

// A result of so many generations of the two that kFast asks for.
TuningResult Found(const Study& study, int generations, double cost, double half_width) {
  TuningResult result;
  result.start = study.start();
  result.tuned = {1.5};
  for (int g = 0; g <= generations; ++g)
    result.generations.push_back({.generation = g, .trials = 4 * g + 4, .gains = {1.5}});
  batch::ComparedTrial slow, fast;
  slow.values[0] = 20;
  fast.values[0] = 19;
  slow.outcome = fast.outcome = trial::Outcome::kSuccess;
  batch::PairedTrials pairs;
  pairs.Add(slow, fast);
  result.held_out = {
      {.pairs = 3, .mean = cost, .confidence = {cost - half_width, cost + half_width}},
      {{"tracking_rms_m", 12, 11.5}},
      pairs.Changes("all")};
  result.finished = true;
  return result;
}

std::string FactOf(const report::Report& report, const std::string& label) {
  for (const report::Fact& fact : report.facts)
    if (fact.label == label) return fact.value;
  return "";
}

TEST(TuningReport, CountsTheGenerationsAfterTheStart) {
  const Study study = StudyOf(kStudy + kFast);
  TuningResult result = Found(study, 2, -1, 0.5);
  EXPECT_EQ(FactOf(ReportOf(study, result), "generations"), "2");
  result.finished = false;
  result.generations.pop_back();
  EXPECT_EQ(FactOf(ReportOf(study, result), "generations"), "1 of 2");
  EXPECT_EQ(ReportOf(study, result).verdict.reason, "1 of 2 generations are done.");
  result.generations.clear();
  EXPECT_EQ(FactOf(ReportOf(study, result), "generations"), "0 of 2");
}

TEST(TuningReport, CallsADifferenceOneOnlyWhereItsIntervalLeavesZero) {
  const Study study = StudyOf(kStudy + kFast);
  const auto verdict = [&](double cost) {
    return ReportOf(study, Found(study, 2, cost, 0.5)).verdict;
  };
  EXPECT_EQ(verdict(-1).word, "better on held-out seeds");
  EXPECT_EQ(verdict(-1).tone, report::Tone::kGood);
  EXPECT_EQ(verdict(1).word, "worse on held-out seeds");
  EXPECT_EQ(verdict(1).tone, report::Tone::kBad);
  for (const double cost : {-0.4, 0.0, 0.4}) {
    EXPECT_EQ(verdict(cost).word, "no significant difference");
    EXPECT_EQ(verdict(cost).tone, report::Tone::kNone);
  }
}

TEST(TuningReport, ShowsTheCostOverTheTrialsAndWhatItIs) {
  const Study study = StudyOf(kStudy + kFast);
  TuningResult result = Found(study, 2, -1, 0.5);
  for (GenerationRecord& generation : result.generations) generation.best = 16;
  result.generations[2].replaced = true;
  const auto convergence = [&] { return ReportOf(study, result).sections[1]; };
  ASSERT_EQ(convergence().title, "Convergence");
  const std::vector<report::Series> series = convergence().panels[0].series;
  EXPECT_EQ(series[1].points[1].x, 8);
  EXPECT_EQ(series[1].points[1].y, 16);
  EXPECT_FALSE(std::isfinite(series[3].points[1].y)) << "nothing was replaced";
  EXPECT_EQ(series[3].points[2].y, 16);
  // a start that is far worse is shown, and squeezes nothing
  for (GenerationRecord& generation : result.generations)
    generation.median = generation.incumbent = 20;
  EXPECT_FALSE(convergence().panels[0].y.logarithmic);
  result.generations[1].median = 197;
  EXPECT_TRUE(convergence().panels[0].y.logarithmic);
  EXPECT_FALSE(std::isfinite(convergence().panels[0].y.high));
}

TEST(TuningReport, ShowsTheCostOfEveryCandidateOverEachGain) {
  const Study study = StudyOf(kStudy + kFast);
  TuningResult result = Found(study, 2, -1, 0.5);
  for (GenerationRecord& generation : result.generations) generation.incumbent = 20;
  result.generations[1].tried = {{{0.5}, 30}, {{1.5}, 10}};
  const report::Section section = ReportOf(study, result).sections[2];
  ASSERT_EQ(section.panels.size(), 1u);
  const report::Panel& panel = section.panels[0];
  ASSERT_EQ(panel.series[0].points.size(), 2u);
  EXPECT_EQ(panel.series[0].points[1].x, 1.5);
  EXPECT_EQ(panel.series[0].points[1].y, 0.5) << "half of what the incumbent costs";
  EXPECT_EQ(panel.rules[2].at, 1.5) << "the best so far";
}

TEST(TuningReport, SaysInEveryFormWhatTheTunedGainsDoOnHeldOutSeeds) {
  const Study study = StudyOf(kStudy + kFast);
  const report::Report report = ReportOf(study, Found(study, 2, -1, 0.5));
  EXPECT_THAT(report::Text(report), ::testing::ContainsRegex("time, s +20 +19 +-1 "));
  EXPECT_THAT(report::Markdown(report), HasSubstr("| time, s | 20 | 19 | -1 |"));
  EXPECT_THAT(report::Markdown(report), HasSubstr("| | 1000 | 0 | 12.00 | 11.50 |"));
  EXPECT_THAT(report::Text(report), HasSubstr("Before and after, on held-out seeds\n"));
  EXPECT_THAT(report::Document(report, report::Json::object())["report"].dump(),
              HasSubstr("tuned less before on the same seeds"));
}

}  // namespace
}  // namespace turbidock::tuning
