#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/report_output.h"
#include "experiments/config/data_files.h"
#include "experiments/report/json.h"
#include "experiments/studies/check_vehicle/check_vehicle.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/scenario.h"

namespace turbidock::check_vehicle {
namespace {

namespace fs = std::filesystem;

struct CheckArguments {
  std::string file;
  std::string scenario = "sea_night_active";
  std::vector<std::string> assignments;
  std::string mjcf;
  app::ReportOutput output;
};

// What MuJoCo makes of a URDF or a whole MJCF model that is no vehicle of this program yet, and
// what it lacks.
[[noreturn]] void RefuseForeign(const std::string& file, const mjModel& model,
                                const std::string& mjcf) {
  char message[500] = "";
  if (!mjcf.empty() && !mj_saveLastXML(mjcf.c_str(), &model, message, sizeof message))
    throw ConfigError(mjcf + ": " + message);
  std::vector<std::string> lacking;
  for (const vehicle::ModelName& name : vehicle::LackingVehicleNames(model))
    lacking.push_back(fmt::format("{} {} ({})", name.kind, name.name, name.meaning));
  throw ConfigError(fmt::format(
      "{}: MuJoCo reads it ({} bodies, {} geoms), but it is no vehicle yet: it lacks {}{}", file,
      model.nbody - 1, model.ngeom, fmt::join(lacking, "; "),
      mjcf.empty() ? ". --mjcf FILE writes it as MJCF, to go on from"
                   : ". " + mjcf + " is it as MJCF"));
}

// Those with data beside their MJCF.
std::string BundledVehicles() {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(config::ModelPath("")))
    if (entry.path().extension() == ".yaml") names.insert(entry.path().stem().string() + ".xml");
  return fmt::format("bundled: {}", fmt::join(names, ", "));
}

// A URDF, and what has no data beside it, must be a vehicle by itself to go on.
void RequireVehicle(const std::string& file, const std::string& mjcf) {
  std::error_code ignored;
  const bool is_urdf = fs::path(file).extension() == ".urdf";
  if (file.empty()) throw ConfigError("give the vehicle's MJCF (" + BundledVehicles() + ")");
  if (!fs::is_regular_file(file, ignored)) {
    if (fs::is_regular_file(config::ModelPath(file), ignored)) return;
    throw ConfigError(file + ": no such file, and no bundled vehicle of that name (" +
                      BundledVehicles() + ")");
  }
  if (!is_urdf && fs::is_regular_file(fs::path(file).replace_extension(".yaml"), ignored)) return;
  vehicle::MjModelPtr model;
  try {
    model = vehicle::LoadModel(file);
  } catch (const ConfigError&) {
    if (is_urdf) throw;
    return;  // part of a scene
  }
  if (!vehicle::LackingVehicleNames(*model).empty()) RefuseForeign(file, *model, mjcf);
}

// A file's name is any text: as JSON it is the same in YAML.
std::string VehicleModel(const std::string& file) {
  return "vehicle_model=" + report::JsonLine(report::Json(file));
}

int Check(const CheckArguments& arguments) {
  system::OutputPlan outputs;
  outputs.Reads(arguments.file)
      .Reads(std::filesystem::path(arguments.file).replace_extension(".yaml").string())
      .Reads(arguments.scenario)
      .Writes(arguments.mjcf);
  arguments.output.Plan("check_vehicle", &outputs);
  outputs.Require();
  RequireVehicle(arguments.file, arguments.mjcf);
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
            "The vehicle's MJCF, its data (NAME.yaml) beside it: a path, or a bundled one, which "
            "are\nlisted without it");
  check.Add("--scenario", arguments.scenario, "In whose sea, before whose station");
  check.AddSet(arguments.assignments, "Set one key, such as vehicle.rigid_body.mass_kg=14");
  check.Add("--mjcf FILE", arguments.mjcf, "Write a URDF as the MJCF that MuJoCo makes of it");
  arguments.output.AddTo(&check, "Folder for the report: .json, .md, .html, check_vehicle.png");
  check.Footer("Exit code 1 when there is a problem with which it cannot dock.");
}

}  // namespace turbidock::check_vehicle
