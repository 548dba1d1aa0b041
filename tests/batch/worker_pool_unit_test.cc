// Worker processes: what each end of a job looks like, and that none harms another's.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <utility>

#include "experiments/batch/job_pool.h"
#include "sim/base/check.h"

#ifndef __has_feature  // clang's
#define __has_feature(x) 0
#endif

namespace turbidock::batch {
namespace {

using ::testing::HasSubstr;

std::string Act(const std::string& what) {
  std::printf("about to %s\n", what.c_str());
  if (what == "abort") std::abort();
  if (what == "exit") _exit(3);
  if (what == "throw") throw std::runtime_error("no such luck");
  if (what == "bad input") throw ConfigError("key = 3, must be 4");
  if (what == "fault") throw SimulatorFault("nothing to draw with");
  if (what == "hang")
    for (;;) pause();
  if (what == "run out of memory") {
#if defined(__SANITIZE_ADDRESS__) || __has_feature(address_sanitizer)
    throw std::bad_alloc();  // its own operator new ends the process instead
#else
    const rlimit limit = {1 << 28, 1 << 28};
    setrlimit(RLIMIT_AS, &limit);
    return std::string(what.size() << 28, 'x');  // no constant, at which clang 14 ends
#endif
  }
  if (what == "be killed") kill(getpid(), SIGKILL);
  return "did " + what;
}

std::unique_ptr<JobPool> Pool(const JobOptions& options,
                              std::function<std::string(const std::string&)> work,
                              double time_limit_s = 600) {
  return MakePool(options, time_limit_s, {"test", std::move(work)});
}

// Runs the jobs and returns their results by number.
std::map<int64_t, JobResult> ResultsOf(int workers, const std::vector<std::string>& inputs,
                                       double time_limit_s = 600) {
  const auto pool = Pool({.workers = workers}, Act, time_limit_s);
  for (size_t i = 0; i < inputs.size(); ++i)
    pool->Submit({.id = static_cast<int64_t>(i), .input = inputs[i]});
  std::map<int64_t, JobResult> results;
  while (pool->pending() > 0)
    if (auto result = pool->Next(60)) {
      EXPECT_FALSE(results.contains(result->id));
      results[result->id] = *result;
    }
  EXPECT_EQ(results.size(), inputs.size());
  return results;
}

TEST(WorkerPool, EveryEndIsAResultAndTheOthersGoOn) {
  for (const int workers : {1, 3}) {
    const auto results = ResultsOf(workers, {"a", "abort", "b", "exit", "throw", "c", "bad input",
                                             "fault", "run out of memory", "be killed", "d"});
    for (const int64_t id : {0, 2, 5, 10}) EXPECT_EQ(results.at(id).end, JobEnd::kDone);
    EXPECT_EQ(results.at(10).output, "did d");
    EXPECT_GT(results.at(10).rss_bytes, 100000);
    const auto expect_crash = [&](int64_t id, const char* error, const char* log) {
      EXPECT_EQ(results.at(id).end, JobEnd::kCrashed) << id;
      EXPECT_THAT(results.at(id).error, HasSubstr(error));
      EXPECT_THAT(results.at(id).log, HasSubstr(log));
    };
    expect_crash(1, "signal 6", "about to abort");
    expect_crash(3, "exit status 3", "about to exit");
    expect_crash(4, "exception", "about to throw\nno such luck");
    expect_crash(8, "exception", "bad_alloc");
    expect_crash(9, "signal 9", "about to be killed");
    EXPECT_EQ(results.at(6).end, JobEnd::kBadInput);
    EXPECT_EQ(results.at(6).error, "key = 3, must be 4");
    EXPECT_EQ(results.at(7).end, JobEnd::kFault);
  }
}

TEST(WorkerPool, AHangIsStoppedAfterItsTimeLimit) {
  const auto results = ResultsOf(2, {"hang", "a", "b", "c"}, 0.5);
  EXPECT_EQ(results.at(0).end, JobEnd::kHung);
  EXPECT_THAT(results.at(0).error, HasSubstr("no end after 0.5 s"));
  EXPECT_GE(results.at(0).wall_time_s, 0.5);
  for (const int64_t id : {1, 2, 3}) EXPECT_EQ(results.at(id).end, JobEnd::kDone);
}

// Ctrl-Z, a batch system that suspends jobs, a laptop's lid.
TEST(WorkerPool, APauseOfTheWholeProgramIsNoHang) {
  const pid_t program = fork();
  if (program == 0) {
    setpgid(0, 0);
    const auto work = [](const std::string&) {
      for (int i = 0; i < 40; ++i) usleep(10'000);  // one long sleep would go on in the pause
      return std::string("done");
    };
    const auto pool = Pool({}, work, /*time_limit_s=*/1);
    pool->Submit({.id = 1, .input = ""});
    std::optional<JobResult> result;
    while (!result) result = pool->Next(60);
    _exit(result->end == JobEnd::kDone ? 0 : 1);
  }
  setpgid(program, program);
  usleep(200'000);
  kill(-program, SIGSTOP);
  usleep(1'500'000);
  kill(-program, SIGCONT);
  int status = 0;
  waitpid(program, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(WorkerPool, CarriesAnyTextAndSaysEachJobsOwnWords) {
  std::string odd = "line\nline\0\"\\\xc3\xa9";
  odd.push_back('\0');
  odd += std::string(1 << 20, 'y');
  const auto results = ResultsOf(1, {odd, "b"});
  EXPECT_EQ(results.at(0).output, "did " + odd);
  EXPECT_EQ(results.at(1).log, "about to b\n");
}

TEST(WorkerPool, NextReturnsAtItsTimeoutAndWithoutJobsAtOnce) {
  const auto pool = Pool({}, Act);
  EXPECT_FALSE(pool->Next(600));
  pool->Submit({.id = 1, .input = "hang"});
  EXPECT_FALSE(pool->Next(0.05));
  EXPECT_EQ(pool->pending(), 1u);
}  // and ends, though the job does not

TEST(WorkerPool, StartsNoMoreProcessesThanThereAreJobs) {
  int started = 0;
  const auto count = [&started] {
    ++started;
    return fork();
  };
  const auto pool = Pool({.workers = 5, .fork = count}, Act);
  EXPECT_EQ(started, 0);
  for (const int64_t id : {1, 2}) pool->Submit({.id = id, .input = "a"});
  while (pool->pending() > 0) pool->Next(60);
  EXPECT_EQ(started, 2);
}

TEST(WorkerPool, ReplacesAWorkerThatDiedWithoutAJob) {
  const auto pool = Pool({}, [](const std::string&) { return std::to_string(getpid()); });
  pool->Submit({.id = 1, .input = ""});
  const pid_t first = std::stoi(pool->Next(60)->output);
  kill(first, SIGKILL);
  while (kill(first, 0) == 0 && waitid(P_PID, first, nullptr, WEXITED | WNOWAIT) != 0) {
  }
  pool->Submit({.id = 2, .input = ""});
  const auto result = pool->Next(60);
  EXPECT_EQ(result->end, JobEnd::kDone);
  EXPECT_NE(std::stoi(result->output), first);
}

}  // namespace
}  // namespace turbidock::batch
