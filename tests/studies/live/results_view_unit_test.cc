// How far a file of trials is, while it grows.

#include "experiments/studies/live/results_view.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "experiments/farm/result_store.h"

namespace turbidock::live {
namespace {

farm::StoredTrial Trial(int64_t number, bool docks) {
  farm::StoredTrial trial{
      .trial = number, .parameters = {{"water.milk_ml_m3", "20"}}, .record = {}};
  trial.record.failure = docks ? trial::Failure::kNone : trial::Failure::kTimeout;
  trial.record.outcome = docks ? trial::Outcome::kDocked : trial::Outcome::kTimeout;
  trial.record.seed = number;
  return trial;
}

TEST(ResultsProgress, GrowsWithTheFile) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / "turbidock_results_view_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const std::string file = (folder / "sweep.db").string();
  ResultsProgress progress;
  EXPECT_THROW(progress.Look(file, 0), ConfigError);
  {
    farm::ResultStore store =
        farm::ResultStore::Write(file, {.plan = "schema_version: 1\nseeds: 10\n",
                                        .build = "none",
                                        .shard = {},
                                        .trials = 10,
                                        .keys = {"water.milk_ml_m3"}});
    report::Json now = progress.Look(file, 100);
    EXPECT_EQ(now["running"], true);
    EXPECT_EQ(now["done"], 0);
    EXPECT_EQ(now["wanted"], 10);
    EXPECT_TRUE(now["by_hour"].is_null());
    for (int i = 0; i < 4; ++i) store.Add(Trial(i, i < 3));
    now = progress.Look(file, 110);
    EXPECT_EQ(now["done"], 4);
    EXPECT_EQ(now["successes"], 3);
    EXPECT_DOUBLE_EQ(now["by_hour"], 4 * 360);
    // of four, three: 0.301 to 0.954 (Wilson)
    EXPECT_NEAR(now["wilson"][0], 0.301, 0.001);
    EXPECT_NEAR(now["wilson"][1], 0.954, 0.001);
  }
  EXPECT_EQ(progress.Look(file, 120)["running"], false);
  // what was there before is no speed of today
  EXPECT_TRUE(ResultsProgress().Look(file, 130)["by_hour"].is_null());
  std::filesystem::remove_all(folder);
}

TEST(ResultsProgress, CountsAStudysTrialsWhoseNumberNobodyKnows) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / "turbidock_results_view_study.sqlite";
  std::filesystem::remove(file);
  farm::ResultStore store = farm::ResultStore::Write(file.string(), {.kind = "tune",
                                                                     .plan = "gains: []\n",
                                                                     .build = "none",
                                                                     .shard = {},
                                                                     .trials = 0,
                                                                     .keys = {"water.milk_ml_m3"}});
  // numbered from a multiple of a million for each candidate
  for (const int64_t number : {0, 1, 1000000, 1000001}) store.Add(Trial(number, number != 1));
  const report::Json now = ResultsProgress().Look(file.string(), 0);
  EXPECT_EQ(now["done"], 4);
  EXPECT_EQ(now["successes"], 3);
  EXPECT_TRUE(now["wanted"].is_null());
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace turbidock::live
