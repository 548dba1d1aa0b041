#include "experiments/farm/fork_map.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "experiments/farm/worker_pool.h"
#include "sim/base/check.h"

namespace turbidock::farm {
namespace {

std::string Square(int i) { return std::to_string(i * i); }

TEST(ForkMap, KeepsTheOrderWhateverTheWorkers) {
  std::vector<std::string> expected;
  for (int i = 0; i < 40; ++i) expected.push_back(Square(i));
  for (const int workers : {1, 2, 7, 100})
    EXPECT_EQ(ForkMap(40, Square, {.workers = workers}), expected) << workers;
  EXPECT_TRUE(ForkMap(0, Square, {.workers = 3}).empty());
}

TEST(ForkMap, CarriesLongTexts) {
  const auto text = [](int i) { return std::string(300000, static_cast<char>('a' + i)); };
  const auto results = ForkMap(5, text, {.workers = 2});
  ASSERT_EQ(results.size(), 5u);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(results[static_cast<size_t>(i)], text(i));
}

TEST(ForkMap, WorksInOtherProcesses) {
  const std::string own = std::to_string(getpid());
  const auto pid = [](int) { return std::to_string(getpid()); };
  EXPECT_EQ(ForkMap(1, pid, {.workers = 1}).front(), own);
  for (const std::string& other : ForkMap(4, pid, {.workers = 2})) EXPECT_NE(other, own);
}

TEST(ForkMap, CountsProgress) {
  for (const int workers : {1, 3}) {
    std::vector<int> seen;
    ForkMap(6, Square, {.workers = workers, .on_progress = [&](int done, int of) {
                          EXPECT_EQ(of, 6);
                          seen.push_back(done);
                        }});
    EXPECT_EQ(seen, (std::vector<int>{1, 2, 3, 4, 5, 6}));
  }
}

TEST(ForkMap, PassesErrorsOn) {
  const auto fail = [](int i) -> std::string {
    if (i == 3) throw ConfigError("water.milk_ml_m3", "is wrong");
    return "";
  };
  for (const int workers : {1, 2})
    EXPECT_THROW(ForkMap(5, fail, {.workers = workers}), ConfigError);
}

TEST(ForkMap, SaysThatAWorkerDied) {
  const auto die = [](int i) -> std::string {
    if (i == 1) _exit(9);
    return "";
  };
  EXPECT_THROW(ForkMap(3, die, {.workers = 3}), SimulatorFault);
}

TEST(ForkMap, Stops) {
  for (const int workers : {1, 2}) {
    int done = 0;
    EXPECT_TRUE(ForkMap(1000, Square,
                        {.workers = workers,
                         .on_progress = [&](int n, int) { done = n; },
                         .stop_requested = [&] { return done > 3; }})
                    .empty());
    EXPECT_GT(done, 3);
  }
}

TEST(ForkMap, DoesNotWaitForAJobWhenItIsStopped) {
  const auto sleep = [](int) {
    std::this_thread::sleep_for(std::chrono::minutes(5));
    return std::string();
  };
  for (const int workers : {1, 2}) {
    const auto start = std::chrono::steady_clock::now();
    EXPECT_TRUE(
        ForkMap(2, sleep, {.workers = workers, .stop_requested = [] { return true; }}).empty());
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
  }
}

TEST(MapEach, GivesOutputsAsTheyComeFromAPoolThatIsKept) {
  WorkerPool pool(2, {}, [](const std::string& input) {
    if (input == "slow") std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return input + "!";
  });
  for (int round = 0; round < 2; ++round) {
    std::vector<std::pair<size_t, std::string>> came;
    EXPECT_TRUE(MapEach(
        &pool, {"slow", "quick"},
        [&](size_t i, const std::string& out) { came.emplace_back(i, out); }, nullptr));
    EXPECT_EQ(came, (std::vector<std::pair<size_t, std::string>>{{1, "quick!"}, {0, "slow!"}}));
  }
}

}  // namespace
}  // namespace turbidock::farm
