// Jobs as tasks of a Slurm that is a few lines of shell: what the pool does with results, losses
// and refusals. The real one is tests/cluster/slurm_test.sh.

#include "experiments/batch/job_pool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "sim/base/check.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"

namespace turbidock::batch {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::TextOf;

const std::vector<Work> kWorks = {
    {"square",
     [](const std::string& input) {
       const int x = std::stoi(input);
       if (x < 0) throw ConfigError("negative");
       if (x == 99) abort();
       return std::to_string(x * x);
     }},
    {"name", [](const std::string& input) { return "I am " + input; }}};

std::string FaultOf(auto&& action) {
  try {
    action();
  } catch (const SimulatorFault& error) {
    return error.what();
  }
  return "no fault";
}

// A job's script runs this program, as the real one runs turbidock.
int RunAsTask(char** argv) {
  try {
    RunSlurmTask(argv[2], std::atoi(argv[4]), std::atoi(argv[6]), kWorks);
    return 0;
  } catch (const SimulatorFault& fault) {
    std::fprintf(stderr, "%s\n", fault.what());
    return 4;
  }
}

class Slurm : public testing::OwnFolder {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "bin");
    // Runs an array's tasks at once. A file "lose" in the folder is a number of arrays whose task 0
    // never starts; "refuse" what is said instead.
    Program("sbatch", R"sh(
echo "$script" >>tried
if [ -e refuse ]; then cat refuse >&2; exit 1; fi
last=$(sed -n 's/^#SBATCH --array=0-//p' "$script")
job=$(($(cat job 2>/dev/null || echo 100) + 1))
echo $job >job
echo $((last + 1)) >>sent
lose=$(cat lose 2>/dev/null || echo 0)
echo $((lose > 0 ? lose - 1 : 0)) >lose
for task in $(seq 0 "$last"); do
  if [ "$task" = 0 ] && [ "$lose" -gt 0 ]; then continue; fi
  echo "$job $task R" >"queue.$task"
  (SLURM_ARRAY_TASK_ID=$task bash "$script"; rm -f "queue.$task") </dev/null >/dev/null 2>&1 &
done
echo $job
)sh");
    Program("squeue", R"sh(
if [ -e away ]; then echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2; exit 1; fi
cat queue.* 2>/dev/null || true
)sh");
    Program("scancel", "echo \"$@\" >>cancelled\n");
    path_ = std::getenv("PATH");
    setenv("PATH", ((folder_ / "bin").string() + ":" + path_).c_str(), 1);
  }
  void TearDown() override {
    setenv("PATH", path_.c_str(), 1);
    // the shells that ran tasks may still be tidying up
    std::error_code error;
    do fs::remove_all(folder_, error);
    while (error);
  }

  void Program(const std::string& name, const std::string& text) const {
    const fs::path path = folder_ / "bin" / name;
    std::ofstream(path) << "#!/bin/bash\nscript=${!#}\ncd '" << folder_.string() << "'\n" << text;
    fs::permissions(path, fs::perms::owner_all);
  }
  // Of tasks that do this work with one worker each.
  std::unique_ptr<JobPool> Pool(int tasks, const std::string& work) {
    const SlurmParams slurm = {.tasks = tasks,
                               .options = {"--time=10"},
                               .folder = (folder_ / "shared place").string(),
                               .say = [this](const std::string& text) { said_ += text + "\n"; }};
    return MakePool({.slurm = slurm}, /*time_limit_s=*/60, {work, nullptr});
  }
  // What comes of the numbers, by job.
  std::map<int64_t, JobResult> Squares(JobPool* pool, const std::vector<int>& numbers) {
    for (const int x : numbers) pool->Submit({.id = x, .input = std::to_string(x)});
    std::map<int64_t, JobResult> results;
    while (pool->pending() > 0)
      if (auto result = pool->Next(10)) results[result->id] = *result;
    return results;
  }

  std::string path_, said_;
};

TEST_F(Slurm, EveryEndIsAResultAndAnArrayIsWhatWaits) {
  {
    const auto pool = Pool(3, "square");
    const auto results = Squares(pool.get(), {0, 1, 2, 3, 4, 5, 6, 7, 99, -1});
    ASSERT_EQ(results.size(), 10u);
    for (int x = 0; x < 8; ++x) EXPECT_EQ(results.at(x).output, std::to_string(x * x));
    EXPECT_EQ(results.at(99).end, JobEnd::kCrashed);
    EXPECT_THAT(results.at(99).error, HasSubstr("signal 6"));
    EXPECT_EQ(results.at(-1).end, JobEnd::kBadInput);
    EXPECT_EQ(results.at(-1).error, "negative");
    EXPECT_EQ(TextOf(folder_ / "sent"), "3\n");
    EXPECT_EQ(Squares(pool.get(), {5}).at(5).output, "25");
    EXPECT_EQ(TextOf(folder_ / "sent"), "3\n1\n");
  }
  EXPECT_FALSE(fs::exists(folder_ / "shared place"));
  EXPECT_EQ(TextOf(folder_ / "cancelled"), "");
  EXPECT_EQ(said_, "");
}

TEST_F(Slurm, WhatALostTaskLeftIsSentAgain) {
  File("lose", "1");
  const auto pool = Pool(2, "square");
  const auto results = Squares(pool.get(), {1, 2, 3, 4});
  ASSERT_EQ(results.size(), 4u);
  EXPECT_EQ(results.at(4).output, "16");
  EXPECT_THAT(said_,
              HasSubstr("1 tasks of Slurm's are gone without 2 results, submitted again; 101_0"));
}

TEST_F(Slurm, AJobThatLosesItsTaskThreeTimesIsAFault) {
  File("lose", "9");
  const auto pool = Pool(1, "square");
  EXPECT_THAT(FaultOf([&] { Squares(pool.get(), {1}); }),
              HasSubstr("ended 3 times without a result of a job; the last one, 103_0"));
}

TEST_F(Slurm, ARefusalIsSaidAtOnce) {
  File("refuse", "sbatch: error: invalid partition specified: nowhere");
  const auto pool = Pool(1, "square");
  EXPECT_THAT(FaultOf([&] { Squares(pool.get(), {1}); }), HasSubstr("nowhere"));
}

TEST_F(Slurm, ResultsAreReadWhileTheControllerIsAway) {
  const auto pool = Pool(1, "square");
  EXPECT_EQ(Squares(pool.get(), {2}).at(2).output, "4");
  File("away", "");
  EXPECT_EQ(Squares(pool.get(), {3}).at(3).output, "9");
}

TEST_F(Slurm, ARefusalAfterTheFirstArrayIsWaitedOut) {
  const auto pool = Pool(1, "square");
  EXPECT_EQ(Squares(pool.get(), {2}).at(2).output, "4");
  File("refuse", "sbatch: error: Batch job submission failed: Transport endpoint is not connected");
  pool->Submit({.id = 4, .input = "4"});
  // on a busy machine sbatch takes its time
  for (int i = 0; i < 400 && said_.empty(); ++i) EXPECT_FALSE(pool->Next(0.3));
  EXPECT_EQ(pool->pending(), 1u);
  EXPECT_THAT(said_, HasSubstr("Slurm fails, trying again: sbatch ended with"));
  fs::remove(folder_ / "refuse");
  const auto result = pool->Next(60);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->output, "16");
  // each try has a folder of its own
  std::istringstream tried(TextOf(folder_ / "tried"));
  std::set<std::string> folders;
  size_t tries = 0;
  for (std::string script; std::getline(tried, script); ++tries) folders.insert(script);
  EXPECT_GE(tries, 3u);
  EXPECT_EQ(folders.size(), tries);
}

// A run that was killed: its tasks are nobody's, its files are not read.
TEST_F(Slurm, WhatAKilledRunLeftIsCancelled) {
  fs::create_directories(folder_ / "shared place/array-0");
  File("shared place/array-0/result-0-0.json", "{\"id\": 0, torn");
  const auto pool = Pool(1, "square");
  EXPECT_THAT(TextOf(folder_ / "cancelled"), HasSubstr("--name=turbidock-"));
  EXPECT_EQ(Squares(pool.get(), {2}).at(2).output, "4");
}

TEST_F(Slurm, ATaskGoesOnWhereItsFirstStartStopped) {
  const auto pool = Pool(1, "name");
  Program("sbatch", R"sh(
array=$(dirname "$script")
printf '%s' '{"end":0,"output":"the first start","error":"","cpu_time_s":0,"rss_bytes":0,"id":0,"log":"","wall_time_s":0}' \
  >"$array/result-0-0.json"
printf '%s' '{"end":0,"output":"torn' >"$array/result-0-1.json.partial"
SLURM_ARRAY_TASK_ID=0 bash "$script" >/dev/null 2>&1
echo 7
)sh");
  pool->Submit({.id = 10, .input = "a"});
  pool->Submit({.id = 11, .input = "b"});
  std::map<int64_t, std::string> outputs;
  while (pool->pending() > 0)
    if (auto result = pool->Next(10)) outputs[result->id] = result->output;
  EXPECT_THAT(outputs, ElementsAre(std::pair(10, "the first start"), std::pair(11, "I am b")));
}

TEST_F(Slurm, ATaskOfAnotherProgramIsRefused) {
  const auto pool = Pool(1, "square");
  Program("sbatch", R"sh(
cd "$(dirname "$script")"
sed -i '1s/"build":"[^"]*"/"build":"0.0.9 other"/' jobs-0.jsonl
SLURM_ARRAY_TASK_ID=0 bash "$script" >task-0.log 2>&1
echo 7
)sh");
  EXPECT_THAT(FaultOf([&] { Squares(pool.get(), {1}); }), HasSubstr("0.0.9 other"));
}

TEST_F(Slurm, ATaskWithoutAListOfJobsSaysSo) {
  File("jobs-0.jsonl", "");
  EXPECT_THAT(MessageOf([&] { RunSlurmTask(folder_.string(), 0, 1, kWorks); }),
              HasSubstr("is no list of jobs"));
}

}  // namespace
}  // namespace turbidock::batch

int main(int argc, char** argv) {
  if (argc == 7 && std::string(argv[1]) == "slurm-task") return turbidock::batch::RunAsTask(argv);
  ::testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}
