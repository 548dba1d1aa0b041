// Where commands look for files that a user's files name, for gains and for the program's own data.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "experiments/command/job_arguments.h"
#include "experiments/config/data_files.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"
#include "tests/support/program.h"

namespace turbidock::command {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;

class FilesOfOthers : public testing::OwnFolder {
 protected:
  void SetUp() override { fs::create_directories(folder_ / "bin"); }
};

TEST_F(FilesOfOthers, APlanNamesModelsThatStandBesideIt) {
  fs::copy_file(config::ModelPath("station.xml"), folder_ / "mine.xml");
  PlanArguments arguments;
  for (const std::string keys :
       {"set: {station.model: mine.xml}\n", "cases: {ours: {station.model: mine.xml}}\n",
        "grid: {station.model: [mine.xml]}\n"}) {
    arguments.plan = File("plan.yaml", "schema_version: 1\nscenario: pool_active\n" + keys);
    const batch::Plan plan = arguments.Load();
    EXPECT_EQ(plan.ScenarioOf(plan.Trial(0)).station_model, (folder_ / "mine.xml").string());
    EXPECT_THAT(plan.files(), Contains((folder_ / "mine.xml").string()));  // not to write over
  }
  arguments.plan = File("plan.yaml",
                        "schema_version: 1\nscenario: pool_active\n"
                        "set: {vehicle.model: bluerov2_heavy.xml, control.use: lqg}\n");
  const batch::Plan bundled = arguments.Load();
  EXPECT_EQ(bundled.ScenarioOf(bundled.Trial(0)).vehicle_model, "bluerov2_heavy.xml");
}

TEST_F(FilesOfOthers, GainsAreReadOverAPlanAndUnderSet) {
  PlanArguments arguments{.plan = "smoke",
                          .gains = File("g.yaml",
                                        "procedure:\n  docking_rate_mps: 0.02\n"
                                        "  enter_x_m: 0.04\n")};
  arguments.assignments = {"procedure.enter_x_m=0.03"};
  const batch::Plan plan = arguments.Load();
  const trial::Scenario scenario = plan.ScenarioOf(plan.Trial(0));
  EXPECT_EQ(scenario.procedure.docking_rate_mps, 0.02);
  EXPECT_EQ(scenario.procedure.enter_x_m, 0.03);
  EXPECT_THAT(plan.files(), Contains(arguments.gains));
  arguments.gains = File("g.yaml", "procedure:\n  docking_rate_mps: fast\n");
  EXPECT_THAT(testing::MessageOf([&] { arguments.Load(); }),
              HasSubstr("g.yaml:2: procedure.docking_rate_mps = 'fast', must be a number"));
  for (const char* command : {"run", "view", "batch", "gate", "bench", "dataset", "step-response"})
    EXPECT_THAT(testing::RunProgram({command, "--help"}).out, HasSubstr("--gains")) << command;
}

TEST_F(FilesOfOthers, TheEnvironmentSaysWhereTheDataAre) {
  const std::string program = (folder_ / "bin/elsewhere").string();
  fs::copy_file(testing::ProgramPath(), program);
  const testing::ProgramEnd given =
      testing::RunProgramAt(program, {"list"}, {"TURBIDOCK_DATA=" + config::DataDir()});
  EXPECT_EQ(given.exit_code, 0) << given.err;
  EXPECT_THAT(given.out, HasSubstr("sea_night_active"));
  const testing::ProgramEnd wrong =
      testing::RunProgramAt(program, {"list"}, {"TURBIDOCK_DATA=/nowhere"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_EQ(wrong.err, "elsewhere: TURBIDOCK_DATA=/nowhere: holds no models/ and assets/\n");
}

}  // namespace
}  // namespace turbidock::command
