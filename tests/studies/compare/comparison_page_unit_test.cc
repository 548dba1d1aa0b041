// The page of a comparison: seeds that changed open their trials in both sets.

#include "experiments/studies/compare/comparison_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/batch/plan.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "tests/support/own_folder.h"
#include "tests/support/stored_trials.h"

namespace turbidock::compare {
namespace {

using ::testing::HasSubstr;

class ComparisonPage : public testing::OwnFolder {
 protected:
  // Of three seeds the second is lost from a to b, which stored no series of it.
  batch::ResultStore Store(const std::string& name, bool is_b) const {
    const batch::Plan plan(
        "schema_version: 1\ndescription: two\nscenario: sea_night_active\nseeds: 3\n"
        "series_every_frames: 1\n",
        "plan");
    static const trial::Series series = trial::Series::Of(
        trial::RunTrial(trial::LoadScenario("sea_night_active", {"estimator.pose_source=true_pose",
                                                                 "trial.duration_s=2"}))
            .log);
    std::vector<batch::StoredTrial> trials;
    for (int64_t i = 0; i < 3; ++i) {
      const bool lost = is_b && i == 1;
      batch::StoredTrial& trial = trials.emplace_back();
      trial.trial = trial.sample = trial.record.seed = i;
      testing::End(&trial.record, lost ? trial::Failure::kFalseLock : trial::Failure::kNone);
      trial.record.reason = lost ? "<b>lost</b>" : "docked";
      if (!is_b) trial.series = series;
    }
    return testing::StoreOf(File(name), batch::HeaderOf(plan, {}), trials);
  }
};

TEST_F(ComparisonPage, HasTheTrialsThatFlippedOnBothSides) {
  const batch::ResultStore a = Store("a.db", false), b = Store("b.db", true);
  const ComparedFile in_a{a, "a.db"}, in_b{b, "sub/b.db"};
  const Comparison comparison = Compare(in_a, in_b, {});
  const page::Page page = PageOf(comparison, in_a, in_b);
  EXPECT_EQ(page.model["kind"], "report");
  EXPECT_EQ(page.model["kind_title"], "comparison");
  EXPECT_FALSE(page.model["sections"].back().contains("commands")) << "to make this page";
  ASSERT_EQ(page.model["links"].size(), 1u) << "of three seeds one flipped";
  const report::Json& link = page.model["links"]["1-1"];
  EXPECT_EQ(link["title"], "Seed 1");
  EXPECT_EQ(link["note"], "Succeeds in A only; in B: false lock.");
  ASSERT_EQ(link["trials"].size(), 2u);
  const report::Json &first = link["trials"][0], &second = link["trials"][1];
  EXPECT_EQ(first["title"], "A: trial 1 of a.db");
  EXPECT_EQ(first["commands"][0]["command"], "turbidock replay a.db 1 --out out/A1");
  EXPECT_EQ(first["outcome"], "success");
  EXPECT_EQ(second["outcome"], "timeout");
  EXPECT_EQ(second["reason"], "<b>lost</b>");
  EXPECT_THAT(second["note"].get<std::string>(), HasSubstr("were not stored"));
  // the series and the model of its scenario are parts of the page, of the second neither
  ASSERT_TRUE(page.parts.contains(first["series"]));
  ASSERT_TRUE(page.parts.contains(first["model"]));
  EXPECT_EQ(page.parts.size(), 2u);
  EXPECT_FALSE(report::ParseJson(page.parts.at(first["model"]), "part")["scene"].is_null());
  EXPECT_EQ(second["model"], "");
  EXPECT_TRUE(page.has_3d);
}

TEST_F(ComparisonPage, WithoutRoomForTracesItSaysHowToSeeThem) {
  const batch::ResultStore a = Store("a.db", false), b = Store("b.db", true);
  const ComparedFile in_a{a, "a.db"}, in_b{b, "b.db"};
  const page::Page page = PageOf(Compare(in_a, in_b, {}), in_a, in_b, /*series_bytes=*/10);
  EXPECT_TRUE(page.parts.empty());
  EXPECT_THAT(page.model["links"]["1-1"]["trials"][0]["note"].get<std::string>(),
              HasSubstr("Its traces are not in this page: the command above makes them"));
}

}  // namespace
}  // namespace turbidock::compare
