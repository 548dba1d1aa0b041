// A trial's resolved.yaml says what its models were read from: who runs it again after one of these
// was edited is told.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "experiments/config/data_files.h"
#include "experiments/trial/trial.h"

namespace turbidock::trial {
namespace {

namespace fs = std::filesystem;

TEST(ResolvedScenario, SaysWhichModelFilesHaveChanged) {
  const fs::path folder =
      fs::temp_directory_path() / ("turbidock_changed_model_" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string own = (folder / "own.xml").string();
  fs::copy_file(config::ModelPath("vehicle.xml"), own);
  fs::copy_file(config::ModelPath("vehicle.yaml"), folder / "own.yaml");
  const Scenario scenario = LoadScenario(
      "pool_active",
      {"estimator.pose_source=true_pose", "trial.duration_s=0.1", "vehicle.model=" + own});
  WriteRecords(folder.string(), scenario, RunTrial(scenario));
  const auto remarks = [&](const std::vector<std::string>& assignments) {
    std::string said;
    TrialOptions options;
    options.on_remark = [&said](const std::string& remark) { said += remark; };
    RunTrial(LoadScenario((folder / "resolved.yaml").string(), assignments), options);
    return said;
  };
  EXPECT_EQ(remarks({}), "");
  std::ofstream(own, std::ios::app) << "<!-- heavier -->\n";
  EXPECT_EQ(remarks({}), own + " has changed since the scenario was written");
  EXPECT_EQ(remarks({"vehicle.model=vehicle.xml"}), "");
  fs::remove_all(folder);
}

}  // namespace
}  // namespace turbidock::trial
