// Jobs that are no trials: a pool does inputs, and gives each output with its input's index.

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "experiments/batch/job_pool.h"
#include "sim/base/check.h"

namespace turbidock::batch {
namespace {

std::unique_ptr<JobPool> Pool(int workers, std::function<std::string(const std::string&)> work) {
  return MakePool({.workers = workers}, kJobTimeLimit_s, {"test", std::move(work)});
}

std::string Echo(const std::string& input) { return input + "!"; }

TEST(MapEach, GivesEveryOutputWithItsIndexWhateverTheWorkers) {
  std::vector<std::string> inputs;
  for (int i = 0; i < 40; ++i) inputs.push_back(std::to_string(i));
  inputs.emplace_back(300000, 'x');
  for (const int workers : {1, 2, 7, 100}) {
    std::vector<std::string> outputs(inputs.size());
    const auto take = [&](size_t i, const std::string& output) { outputs[i] = output; };
    EXPECT_TRUE(MapEach(Pool(workers, Echo).get(), inputs, take, nullptr));
    for (size_t i = 0; i < inputs.size(); ++i) EXPECT_EQ(outputs[i], Echo(inputs[i])) << workers;
  }
  EXPECT_TRUE(MapEach(
      Pool(3, Echo).get(), {}, [](size_t, const std::string&) { FAIL(); }, nullptr));
}

TEST(MapEach, GivesOutputsAsTheyComeFromAPoolThatIsKept) {
  const auto pool = Pool(2, [](const std::string& input) {
    if (input == "slow") std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return Echo(input);
  });
  for (int round = 0; round < 2; ++round) {
    std::vector<std::pair<size_t, std::string>> came;
    EXPECT_TRUE(MapEach(
        pool.get(), {"slow", "quick"},
        [&](size_t i, const std::string& out) { came.emplace_back(i, out); }, nullptr));
    EXPECT_EQ(came, (std::vector<std::pair<size_t, std::string>>{{1, "quick!"}, {0, "slow!"}}));
  }
}

TEST(MapEach, PassesErrorsOn) {
  const auto act = [](const std::string& input) -> std::string {
    if (input == "bad") throw ConfigError("water.milk_ml_m3", "is wrong");
    if (input == "die") _exit(9);
    return "";
  };
  const auto run = [&](const std::string& input) {
    MapEach(
        Pool(2, act).get(), {"a", input, "b"}, [](size_t, const std::string&) {}, nullptr);
  };
  EXPECT_THROW(run("bad"), ConfigError);
  EXPECT_THROW(run("die"), SimulatorFault);
}

TEST(MapEach, StopsWithoutWaitingForAJob) {
  const auto sleep = [](const std::string&) {
    std::this_thread::sleep_for(std::chrono::minutes(5));
    return std::string();
  };
  for (const int workers : {1, 2}) {
    const auto start = std::chrono::steady_clock::now();
    EXPECT_FALSE(MapEach(
        Pool(workers, sleep).get(), {"a", "b"}, [](size_t, const std::string&) { FAIL(); },
        [] { return true; }));
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
  }
}

}  // namespace
}  // namespace turbidock::batch
