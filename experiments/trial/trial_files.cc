#include "experiments/trial/trial_files.h"

#include <fmt/format.h>

#include <filesystem>

#include "experiments/report/json.h"
#include "experiments/system/output_path.h"

namespace turbidock::trial {

ViewCriteria CriteriaOf(const Scenario& scenario) {
  return {.docking_fitness = scenario.procedure.found_fitness,
          .detection_fitness = scenario.procedure.lost_fitness,
          .tolerance_y_m = scenario.procedure.allowance_y_m,
          .tolerance_z_m = scenario.procedure.allowance_z_m,
          .docked_x_m = scenario.procedure.docked_x_m};
}

std::string ResultJson(const TrialRecord& record) { return report::JsonText(record); }

std::string TrajectoryCsv(const TrialLog& log) {
  std::string volts;
  for (const std::string& thruster : log.thrusters) volts += thruster + "_v,";
  std::string csv = fmt::format(
      "frame,time_s,stage,controlled,fitness,"
      "est_x_m,est_y_m,est_z_m,est_qw,est_qx,est_qy,est_qz,"
      "true_x_m,true_y_m,true_z_m,true_qw,true_qx,true_qy,true_qz,"
      "desired_x_m,desired_y_m,desired_z_m,desired_yaw_rad,"
      "{}"
      "vehicle_x_m,vehicle_y_m,vehicle_z_m,vehicle_qw,vehicle_qx,vehicle_qy,vehicle_qz,"
      "surge_mps,sway_mps,heave_mps,roll_rate_rad_s,pitch_rate_rad_s,yaw_rate_rad_s,"
      "insertion_depth_m,dock_force_newton,collision_force_newton\n",
      volts);
  const auto add = [&csv](double x) { csv += "," + FormatNumber(x); };
  const auto add_pose = [&add](const Pose& X) {
    const Pose c = X.Canonical();
    for (const double x : {c.p.x(), c.p.y(), c.p.z(), c.q.w(), c.q.x(), c.q.y(), c.q.z()}) add(x);
  };
  for (const FrameRecord& r : log.frames) {
    csv += fmt::format("{},{},{},{}", r.frame, FormatNumber(r.time_s), NameOf(r.stage),
                       r.controlled ? 1 : 0);
    add(r.fitness);
    add_pose(r.est_X_HM);
    add_pose(r.true_X_HM);
    for (const double x : {r.desired.x_m, r.desired.y_m, r.desired.z_m, r.desired.yaw_rad}) add(x);
    for (size_t i = 0; i < log.thrusters.size(); ++i)
      add(r.command.volts.empty() ? kNeutralVolts : r.command.volts[i]);
    add_pose(r.true_X_WB);
    for (const double x : r.true_V_WB_B.v) add(x);
    for (const double x : r.true_V_WB_B.w) add(x);
    for (const double x : {r.insertion_depth_m, r.dock_force_newton, r.collision_force_newton})
      add(x);
    csv += '\n';
  }
  return csv;
}

void WriteRecords(const std::string& folder, const Scenario& scenario, const TrialResult& result) {
  const std::filesystem::path out(folder);
  system::WriteWhole(out / "resolved.yaml", SaveScenario(scenario));
  system::WriteWhole(out / "trajectory.csv", TrajectoryCsv(result.log));
  system::WriteWhole(out / "result.json", ResultJson(result));
}

}  // namespace turbidock::trial
