#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/report_output.h"
#include "experiments/report/json.h"
#include "experiments/studies/check_vehicle/check_vehicle.h"
#include "experiments/studies/check_vehicle/check_vehicle_report.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/scenario.h"

namespace turbidock::check_vehicle {
namespace {

struct CheckArguments {
  std::string file;
  std::string scenario = "sea_night_active";
  std::vector<std::string> assignments;
  std::string mjcf;
  app::ReportOutput output;
  bool names = false;
};

// What MuJoCo makes of a file that is no vehicle of this program yet.
void ReportForeign(const std::string& file, const std::string& mjcf) {
  const vehicle::MjModelPtr model = vehicle::LoadModel(file);
  double mass_kg = 0;
  for (int body = 1; body < model->nbody; ++body) mass_kg += model->body_mass[body];
  if (!mjcf.empty()) {
    char message[500] = "";
    if (!mj_saveLastXML(mjcf.c_str(), model.get(), message, sizeof message))
      throw ConfigError(mjcf + ": " + message);
  }
  std::string lacking;
  for (const vehicle::ModelName& name : vehicle::LackingVehicleNames(*model))
    lacking += fmt::format("{}{} {}", lacking.empty() ? "" : ", ", name.kind, name.name);
  throw ConfigError(
      fmt::format("{}: MuJoCo reads it ({} bodies, {} geoms, {:.3g} kg), but it is no vehicle yet: "
                  "it lacks {}. "
                  "`turbidock check-vehicle --names` says what they mean{}",
                  file, model->nbody - 1, model->ngeom, mass_kg, lacking,
                  mjcf.empty() ? "; --mjcf FILE writes it as MJCF, to go on from"
                               : "; " + mjcf + " is it as MJCF"));
}

// A URDF, or a whole MJCF model, without the names and the data of a vehicle.
bool IsForeign(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return false;
  const bool is_urdf = fs::path(file).extension() == ".urdf";
  if (!is_urdf && fs::is_regular_file(fs::path(file).replace_extension(".yaml"), ignored))
    return false;
  try {
    return !vehicle::LackingVehicleNames(*vehicle::LoadModel(file)).empty();
  } catch (const ConfigError&) {
    if (is_urdf) throw;
    return false;  // part of a scene
  }
}

// A file's name is any text: as JSON it is the same in YAML.
std::string VehicleModel(const std::string& file) {
  return "vehicle_model=" + report::JsonLine(report::Json(file));
}

int Check(const CheckArguments& arguments) {
  if (arguments.names) {
    std::fputs(NamesTable(false).Text().c_str(), stdout);
    return app::kExitDone;
  }
  if (arguments.file.empty())
    throw ConfigError("check-vehicle", "name the vehicle's file: a bundled one or a path");
  system::OutputPlan outputs;
  outputs.Reads(arguments.file)
      .Reads(std::filesystem::path(arguments.file).replace_extension(".yaml").string())
      .Reads(arguments.scenario)
      .Writes(arguments.mjcf);
  arguments.output.Plan("check_vehicle", &outputs);
  outputs.Require();
  if (IsForeign(arguments.file)) ReportForeign(arguments.file, arguments.mjcf);
  std::vector<std::string> assignments = {VehicleModel(arguments.file)};
  assignments.insert(assignments.end(), arguments.assignments.begin(), arguments.assignments.end());
  const trial::Scenario scenario = trial::LoadScenario(arguments.scenario, assignments);
  if (!arguments.mjcf.empty())
    throw ConfigError("--mjcf " + arguments.mjcf,
                      arguments.file + " is MJCF already: there is nothing to convert");
  const VehicleCheck check = CheckVehicle(scenario);
  arguments.output.Write(ReportOf(check), check);
  return check.problems.empty() ? app::kExitDone : app::kExitCheckFailed;
}

}  // namespace

void AddCheckVehicle(app::CommandLine& line) {
  auto [check, arguments] =
      line.Add("check-vehicle",
               "Tell a vehicle's builder how it floats, moves, sees and fits the dock", &Check);
  check.Add("file", arguments.file,
            "The vehicle's MJCF, its data (NAME.yaml) beside it: a bundled one or a path");
  check.Add("--scenario", arguments.scenario, "In whose sea, before whose station");
  check.AddSet(arguments.assignments, "Set one key, such as vehicle.rigid_body.mass_kg=14");
  check.Add("--mjcf FILE", arguments.mjcf, "Write a URDF as the MJCF that MuJoCo makes of it");
  check.Flag("--names", arguments.names, "List what a vehicle, marker and station must name");
  arguments.output.AddTo(&check, "Folder for the report: .json, .md, .html, check_vehicle.png");
  check.Footer("Exit code 1 when there is a problem with which it cannot dock.");
}

}  // namespace turbidock::check_vehicle
