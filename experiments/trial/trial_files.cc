#include "experiments/trial/trial_files.h"

#include <filesystem>

#include "experiments/report/json.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/series.h"

namespace turbidock::trial {

ViewCriteria CriteriaOf(const Scenario& scenario) {
  return {.docking_fitness = scenario.procedure.found_fitness,
          .detection_fitness = scenario.procedure.lost_fitness,
          .tolerance_y_m = scenario.procedure.allowance_y_m,
          .tolerance_z_m = scenario.procedure.allowance_z_m,
          .docked_x_m = scenario.procedure.docked_x_m,
          .enter_y_m = scenario.procedure.enter_y_m,
          .enter_z_m = scenario.procedure.enter_z_m};
}

void WriteRecords(const std::string& folder, const Scenario& scenario, const TrialResult& result) {
  const std::filesystem::path out(folder);
  system::MakeFolder(folder);
  Scenario resolved = scenario;
  resolved.model_files = ModelFilesOf(scenario);
  system::WriteWhole(out / "resolved.yaml", SaveScenario(resolved));
  system::WriteWhole(out / "trajectory.csv", Series::Of(result.log).Csv());
  system::WriteWhole(out / "result.json", report::JsonText(result));
}

}  // namespace turbidock::trial
