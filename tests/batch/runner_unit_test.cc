// The engine behind batch, gate and tuning: which trials run, which are taken from the file, and
// that neither workers nor stops show in what comes out.

#include "experiments/batch/runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/check.h"
#include "tests/support/own_folder.h"

namespace turbidock::batch {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;

constexpr int64_t kTrials = 12;

Plan TinyPlan(int master_seed = 1) {
  return Plan("schema_version: 1\nscenario: sea_night_active\nseeds: 12\nmaster_seed: " +
                  std::to_string(master_seed) +
                  "\nset: {estimator.pose_source: true_pose, trial.duration_s: 0.1}\n",
              "plan.yaml");
}

// Is satisfied after the first so many trials, counted in their order, whose digests' first
// characters add up to enough.
struct EnoughOfThem {
  int64_t next = 0, counted = 0;
  int sum = 0;
  std::map<int64_t, std::string> digests = {};

  bool enough() const { return sum >= 60; }
  TrialDecider Decider() {
    return {.next = [this]() -> std::optional<int64_t> {
              if (enough() || next == kTrials) return std::nullopt;
              return next++;
            },
            .add =
                [this](const StoredTrial& trial) {
                  digests[trial.trial] = trial.record.digest;
                  for (; !enough() && digests.contains(counted); ++counted)
                    sum += std::stoi(digests[counted].substr(0, 1), nullptr, 16);
                }};
  }
  // That the decision rests on.
  std::vector<std::string> Counted() const {
    std::vector<std::string> all;
    for (int64_t trial = 0; trial < counted; ++trial) all.push_back(digests.at(trial));
    return all;
  }
};

class Runner : public testing::OwnFolder {
 protected:
  ResultStore Store(const std::string& name) const {
    return ResultStore::Write((folder_ / name).string(), HeaderOf(plan_, {}));
  }
  RunOptions Options(int workers) const { return {.jobs = {.workers = workers}}; }

  const Plan plan_ = TinyPlan();
};

TEST_F(Runner, EndsTheSameForAnyWorkersAndAfterAnyStop) {
  EnoughOfThem alone;
  ASSERT_TRUE(TrialRunner(Options(1), nullptr).Run(SourceOf(plan_), alone.Decider()));
  ASSERT_GT(alone.counted, 2);
  ASSERT_LT(alone.counted, kTrials) << "nothing is seen of a decision";
  int stops = 0;
  for (const int workers : {1, 3})
    for (const int64_t stop_after : {1, 2, 5}) {
      const std::string name = std::to_string(workers) + "_" + std::to_string(stop_after) + ".db";
      for (bool ended = false; !ended;) {
        ResultStore store = Store(name);
        const int64_t before = std::ssize(store.Done());
        EnoughOfThem again;
        RunOptions options = Options(workers);
        int64_t run = 0;
        options.on_trial = [&](const StoredTrial&) { ++run; };
        options.stop_requested = [&] { return run >= stop_after; };
        TrialRunner runner(options, &store);
        ended = runner.Run(SourceOf(plan_), again.Decider());
        EXPECT_EQ(runner.progress().done_now, run);
        EXPECT_EQ(std::ssize(store.Done()), before + run) << "a trial has run twice";
        stops += !ended;
        if (ended) {
          EXPECT_EQ(again.Counted(), alone.Counted()) << name;
        }
      }
    }
  EXPECT_GT(stops, 6);
}

TEST_F(Runner, OverACompleteFileNothingStarts) {
  ResultStore store = Store("a.db");
  EnoughOfThem first, again;
  TrialRunner(Options(2), &store).Run(SourceOf(plan_), first.Decider());
  RunOptions options = Options(2);
  options.jobs.fork = [] {
    ADD_FAILURE() << "a process is started";
    return fork();
  };
  TrialRunner runner(options, &store);
  EXPECT_TRUE(runner.Run(SourceOf(plan_), again.Decider()));
  EXPECT_EQ(runner.progress().done_now, 0);
  EXPECT_EQ(again.Counted(), first.Counted());
}

TEST_F(Runner, WithoutAStoreATrialRunsAsOftenAsItIsAskedFor) {
  std::vector<int64_t> ask = {3, 3, 1}, came;
  std::vector<std::string> digests;
  size_t next = 0;
  const TrialDecider decider{
      .next = [&] { return next < ask.size() ? std::optional(ask[next++]) : std::nullopt; },
      .add =
          [&](const StoredTrial& trial) {
            came.push_back(trial.trial);
            digests.push_back(trial.record.digest);
          }};
  EXPECT_TRUE(TrialRunner(Options(1), nullptr).Run(SourceOf(plan_), decider));
  EXPECT_THAT(came, ElementsAre(3, 3, 1));
  EXPECT_EQ(digests[0], digests[1]);
  EXPECT_NE(digests[0], digests[2]);
}

TEST_F(Runner, WhatTheDeciderRefusesIsNotStored) {
  ResultStore store = Store("a.db");
  bool asked = false;
  const TrialDecider decider{
      .next = [&] { return std::exchange(asked, true) ? std::nullopt : std::optional<int64_t>(4); },
      .add = [](const StoredTrial&) { throw SimulatorFault("no verdict"); }};
  EXPECT_THROW(TrialRunner(Options(1), &store).Run(SourceOf(plan_), decider), SimulatorFault);
  EXPECT_THAT(store.Done(), ElementsAre());
}

TEST_F(Runner, AStoredTrialThatIsAnotherIsAMismatch) {
  ResultStore store = Store("a.db");
  EnoughOfThem first, again;
  TrialRunner(Options(2), &store).Run(SourceOf(plan_), first.Decider());
  const Plan other = TinyPlan(/*master_seed=*/2);
  EXPECT_THROW(TrialRunner(Options(1), &store).Run(SourceOf(other), again.Decider()),
               MismatchError);
}

}  // namespace
}  // namespace turbidock::batch
