#include <fmt/ranges.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "experiments/command/command_line.h"
#include "experiments/command/report_output.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/json.h"
#include "experiments/studies/check_vehicle/check_vehicle.h"
#include "experiments/studies/check_vehicle/urdf.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "experiments/trial/scenario.h"
#include "sim/vehicle/model_files.h"

namespace turbidock::check_vehicle {
namespace {

namespace fs = std::filesystem;

struct CheckArguments {
  std::string file;
  std::string scenario = "sea_night_active";
  std::vector<std::string> assignments;
  std::string mjcf;
  command::ReportOutput output;
};

std::string Lacking(const mjModel& model) {
  std::vector<std::string> lacking;
  for (const vehicle::ModelName& name : vehicle::LackingVehicleNames(model))
    lacking.push_back(fmt::format("{} {} ({})", name.kind, name.name, name.meaning));
  return fmt::format("{}", fmt::join(lacking, "; "));
}

// Those with data beside their MJCF.
std::string BundledVehicles() {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(config::ModelPath("")))
    if (entry.path().extension() == ".yaml") names.insert(entry.path().stem().string() + ".xml");
  return fmt::format("bundled: {}", fmt::join(names, ", "));
}

// Any other file than a bundled vehicle's or one with data beside it. What MuJoCo says of a whole
// model, or of a part in the scene of this program, is said.
[[noreturn]] void RefuseForeign(const std::string& file) {
  const std::string data = fs::path(file).replace_extension(".yaml");
  try {
    if (const std::string lacking = Lacking(*vehicle::LoadModel(file)); !lacking.empty())
      throw ConfigError(
          fmt::format("{}: MuJoCo reads it, but it is no vehicle yet: it lacks {}", file, lacking));
  } catch (const ConfigError& alone) {
    const std::string said = alone.what();
    if (said.find("MuJoCo reads it") != std::string::npos) throw;
    try {
      vehicle::ReadModel({.scene = config::ModelPath("sea_active.xml"),
                          .parts = {{"vehicle.xml", file}},
                          .shared = {}});
    } catch (const ConfigError& as_part) {
      throw ConfigError(
          fmt::format("{} (MuJoCo {}, by itself; as a part of a scene: {}); and {} is not there",
                      said, mj_versionString(), as_part.what(), data));
    }
  }
  throw ConfigError(file + ": has no data beside it: " + data);
}

void RequireVehicle(const std::string& file) {
  std::error_code ignored;
  if (file.empty()) throw ConfigError("give the vehicle's MJCF (" + BundledVehicles() + ")");
  if (!fs::is_regular_file(file, ignored)) {
    if (fs::is_regular_file(config::ModelPath(file), ignored)) return;
    throw ConfigError(file + ": no such file, and no bundled vehicle of that name (" +
                      BundledVehicles() + ")");
  }
  if (fs::path(file).extension() == ".yaml")
    throw ConfigError(file + ": is no MJCF; give that, " +
                      fs::path(file).replace_extension(".xml").string() + ", and this beside it");
  if (!fs::is_regular_file(fs::path(file).replace_extension(".yaml"), ignored)) RefuseForeign(file);
}

// Writes a URDF as MJCF and, unless there are such, the data that it has. Says what it is and what
// it lacks; false where it is no vehicle yet.
bool Convert(const std::string& urdf, const fs::path& mjcf) {
  const fs::path data = fs::path(mjcf).replace_extension(".yaml");
  std::error_code ignored;
  if (fs::exists(mjcf, ignored))
    throw ConfigError(
        "--mjcf " + mjcf.string(),
        fmt::format("is there already: remove it to write it anew, and {} if the URDF "
                    "is to give mass and inertia",
                    data.string()));
  const UrdfVehicle vehicle = ReadUrdf(urdf, fs::absolute(mjcf).parent_path());
  system::WriteWhole(mjcf, vehicle.mjcf);
  const vehicle::MjModelPtr model =
      vehicle::ReadModel({.scene = config::ModelPath("sea_active.xml"),
                          .parts = {{"vehicle.xml", mjcf}},
                          .shared = {}});
  const int body = mj_name2id(model.get(), mjOBJ_BODY, "vehicle");
  const double kg = model->body_subtreemass[body], kTol = 1e-6;
  if (std::abs(kg - vehicle.body.mass_kg) > kTol * kg)
    throw ConfigError(fmt::format("{}: its links weigh {} kg, {} {} kg", urdf,
                                  FormatNumber(vehicle.body.mass_kg), mjcf.string(),
                                  FormatNumber(kg)));
  fmt::print(stderr, "{}: {:.4g} kg, as {} has in {} link{}; {} thruster{}{}{}\n", mjcf.string(),
             kg, urdf, vehicle.links, vehicle.links == 1 ? "" : "s", vehicle.thrusters.size(),
             vehicle.thrusters.size() == 1 ? "" : "s", vehicle.thrusters.empty() ? "" : ": ",
             fmt::join(vehicle.thrusters, ", "));
  if (fs::exists(data, ignored)) {
    fmt::print(stderr, "{}: is kept, and counts where it gives another mass or inertia\n",
               data.string());
  } else {
    std::string text = "rigid_body:  # of the URDF\n";
    system::WriteWhole(data, text + system::Indented(config::SaveYaml(vehicle.body), "  "));
    fmt::print(stderr, "{}: mass and inertia; the rest is yours to give\n", data.string());
  }
  if (!vehicle.held.empty())
    fmt::print(stderr, "joints that are held as they stand: {}\n", fmt::join(vehicle.held, ", "));
  if (!vehicle.not_drawn.empty())
    fmt::print(stderr, "left out, for MuJoCo reads .stl, .obj and .msh: {}\n",
               fmt::join(vehicle.not_drawn, "; "));
  const std::string lacking = Lacking(*model);
  if (!lacking.empty()) fmt::print(stderr, "{} still lacks {}\n", mjcf.string(), lacking);
  return lacking.empty();
}

// A file's name is any text: as JSON it is the same in YAML.
std::string VehicleModel(const std::string& file) {
  return "vehicle.model=" + report::JsonLine(report::Json(file));
}

int Check(const CheckArguments& arguments) {
  system::OutputPlan outputs;
  outputs.Reads(arguments.file)
      .Reads(std::filesystem::path(arguments.file).replace_extension(".yaml").string())
      .Reads(arguments.scenario)
      .Writes(arguments.mjcf);
  arguments.output.Plan("check_vehicle", &outputs);
  outputs.Require();
  const bool is_urdf = IsUrdf(arguments.file);
  if (is_urdf && arguments.mjcf.empty())
    throw ConfigError(arguments.file + ": is a URDF; --mjcf NAME.xml makes a vehicle of it");
  if (!is_urdf && !arguments.mjcf.empty())
    throw ConfigError("--mjcf " + arguments.mjcf,
                      arguments.file + " is no URDF: there is nothing to convert");
  if (is_urdf)
    return Convert(arguments.file, arguments.mjcf) ? command::kExitDone : command::kExitCheckFailed;
  RequireVehicle(arguments.file);
  for (const std::string& set : arguments.assignments)
    if (trial::Gives(set, "vehicle.model"))
      throw ConfigError("--set " + set, "the vehicle is the file that is named before");
  std::vector<std::string> assignments = {VehicleModel(arguments.file)};
  assignments.insert(assignments.end(), arguments.assignments.begin(), arguments.assignments.end());
  const trial::Scenario scenario = trial::LoadScenario(arguments.scenario, assignments);
  const VehicleCheck check = CheckVehicle(scenario);
  arguments.output.Write(ReportOf(check), check);
  return check.problems.empty() ? command::kExitDone : command::kExitCheckFailed;
}

}  // namespace

void AddCheckVehicle(command::CommandLine& line) {
  auto [check, arguments] =
      line.Add("check-vehicle",
               "Tell a vehicle's builder how it floats, moves, sees and fits the dock", &Check);
  check.Add("file", arguments.file,
            "The vehicle's MJCF, its data (NAME.yaml) beside it, or a bundled one's name (no "
            "file: lists them); or a URDF");
  check.Add("--scenario", arguments.scenario, "Scenario with the sea and the station");
  check.AddSet(arguments.assignments, "Set one key, such as vehicle.rigid_body.mass_kg=14");
  check.Add(
      "--mjcf FILE", arguments.mjcf,
      "Write a URDF as such a vehicle, with its data beside it; exit code 1 where it lacks a part");
  arguments.output.AddTo(&check, "Folder for the report: .json, .md, .html, check_vehicle.png");
  check.Footer("Exit code 1 when there is a problem with which it cannot dock.");
}

}  // namespace turbidock::check_vehicle
