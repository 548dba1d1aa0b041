// A trial whose worker is killed, from the worker to the comparison: it is counted as what it is
// and has no number that anybody could take for a measurement.

#include <gtest/gtest.h>
#include <unistd.h>

#include <SQLiteCpp/SQLiteCpp.h>
#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "experiments/batch/job_pool.h"
#include "experiments/batch/result_store.h"
#include "experiments/batch/runner.h"
#include "experiments/studies/compare/comparison.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/scenario.h"
#include "tests/support/own_folder.h"
#include "tests/support/stored_trials.h"

namespace turbidock::compare {
namespace {

// Kills every child of this process.
void KillWorkers() {
  std::ifstream children("/proc/self/task/" + std::to_string(gettid()) + "/children");
  int killed = 0;
  for (pid_t pid = 0; children >> pid; ++killed) kill(pid, SIGKILL);
  ASSERT_EQ(killed, 1);
}

batch::StoredTrial RunOne(batch::JobPool* pool, int64_t id, double duration_s, bool kill_it) {
  const trial::Scenario scenario = trial::LoadScenario(
      "pool_active", {"estimator.pose_source=true_pose", "trial.seed=" + std::to_string(70 + id),
                      "trial.duration_s=" + std::to_string(duration_s)});
  pool->Submit(batch::TrialJob(id, scenario));
  if (kill_it) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    KillWorkers();
  }
  std::optional<batch::JobResult> ended;
  while (!ended) ended = pool->Next(1);
  return batch::FinishedTrialOf(*ended, {.seed = scenario.seed, .parameters = {}});
}

using CrashedTrial = testing::OwnFolder;

TEST_F(CrashedTrial, IsNoMeasurementAnywhere) {
  const auto pool = batch::MakePool({.workers = 1}, /*time_limit_s=*/300, batch::TrialWork());
  const batch::StoredTrial whole = RunOne(pool.get(), 0, 1, false);
  const batch::StoredTrial crashed = RunOne(pool.get(), 1, 3000, true);
  const batch::StoredTrial after = RunOne(pool.get(), 2, 1, false);  // by a new worker
  EXPECT_EQ(whole.record.outcome, trial::Outcome::kTimeout);
  EXPECT_EQ(after.record.outcome, trial::Outcome::kTimeout);

  const trial::TrialRecord& record = crashed.record;
  EXPECT_EQ(record.outcome, trial::Outcome::kCrashed);
  EXPECT_EQ(record.failure, trial::Failure::kCrashed);
  EXPECT_EQ(record.seed, 71);
  EXPECT_EQ(record.digest, "");
  EXPECT_FALSE(record.success());
  EXPECT_NE(record.reason.find("killed by signal 9"), std::string::npos) << record.reason;
  for (const trial::Metric& metric : trial::Metrics())
    EXPECT_FALSE(metric.of(record).has_value()) << metric.name;

  const auto stored = [&](const char* name, const std::vector<batch::StoredTrial>& trials) {
    batch::StoreHeader header;
    header.plan = "seeds: 3\n";
    header.build = "test";
    header.trials = 3;
    std::vector<batch::StoredTrial> numbered = trials;
    for (batch::StoredTrial& trial : numbered) trial.trial = trial.record.seed - 70;
    return testing::StoreOf(File(name), header, numbered);
  };
  // In one set the second trial crashed, in the other the third did.
  batch::StoredTrial swapped = crashed, fine = after;
  swapped.record.seed = 72;
  fine.record.seed = 71;
  const batch::ResultStore in_a = stored("a.db", {whole, crashed, after}),
                           in_b = stored("b.db", {whole, fine, swapped});
  {
    const SQLite::Database db(in_a.file());
    SQLite::Statement row(db, "SELECT * FROM results WHERE trial = 1");
    ASSERT_TRUE(row.executeStep());
    int numbers = 0;
    for (int i = 0; i < row.getColumnCount(); ++i) {
      const std::string name = row.getColumnName(i);
      if (row.getColumn(i).isFloat()) ADD_FAILURE() << name << " has a value";
      numbers += row.getColumn(i).isNull();
    }
    EXPECT_GT(numbers, 20);
  }
  const batch::StoredTrial again = in_a.Trial(1);
  EXPECT_EQ(again.record.outcome, trial::Outcome::kCrashed);
  EXPECT_EQ(again.record.seed, 71);
  const std::map<int64_t, bool> successes = in_a.Successes();
  ASSERT_EQ(successes.size(), 3u);
  EXPECT_FALSE(successes.at(1));
  // Neither is paired: what it would have come to is not known.
  const std::vector<TrialPair> pairs = PairTrials(in_a, in_b, {});
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].a.seed, 70);
  const Comparison comparison = Compare({in_a, "a.db"}, {in_b, "b.db"}, {});
  EXPECT_EQ(comparison.unended_a, 1);
  EXPECT_EQ(comparison.unended_b, 1);
  const report::Verdict verdict = ReportOf(comparison).verdict;
  EXPECT_EQ(verdict.word, "no significant change in success, of the trials that ended");
  EXPECT_NE(verdict.reason.find("1 trials of A and 1 of B crashed"), std::string::npos);
  const batch::ResultStore none = stored("none.db", {crashed, swapped});
  try {
    PairTrials(none, in_b, {});
    FAIL() << "nothing to compare";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("none of its trials came to an end"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace turbidock::compare
