// Which vehicles and stations of others `check-vehicle` takes, and what it says of them: the table
// tests/data/variants/vehicles.txt is drawn from the variants below and compared with the committed
// one.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/system/output_path.h"
#include "sim/vehicle/vehicle_params.h"
#include "tests/support/drawn_table.h"
#include "tests/support/program.h"

namespace turbidock::check_vehicle {
namespace {

using testing::Swaps;
using testing::With;

struct Variant {
  std::string kind, name;
  std::string file;  // to be checked
  std::vector<std::pair<std::string, std::string>> files;
  std::vector<std::string> arguments = {};
};

// ------------------------------------------------------------------------------------------- URDF

const std::string kUrdf = R"(<?xml version="1.0"?>
<robot name="rov">
  <link name="base_link">
    <inertial><origin xyz="0 0 -0.02"/><mass value="11.5"/>
      <inertia ixx="0.16" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.25"/></inertial>
    <collision><geometry><box size="0.45 0.34 0.25"/></geometry></collision>
  </link>
  <link name="thruster1">
    <inertial><mass value="0.3"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
    <collision><geometry><cylinder radius="0.04" length="0.1"/></geometry></collision>
  </link>
  <joint name="thruster1_joint" type="fixed"><parent link="base_link"/><child link="thruster1"/>
    <origin xyz="0.14 0.1 0" rpy="0 1.5708 -0.785"/></joint>
</robot>
)";

Variant Urdf(const std::string& name, const Swaps& swaps, Swaps files = {}) {
  files.emplace_back("urdf/a.urdf", With(kUrdf, swaps));
  return {"URDF", name, "urdf/a.urdf", files, {"--mjcf", "out.xml"}};
}

std::vector<Variant> OfUrdf() {
  const std::string box = "<box size=\"0.45 0.34 0.25\"/>", fixed = "type=\"fixed\"",
                    end = "</robot>",
                    obj =
                        "v 0 0 0\nv 0.4 0 0\nv 0 0.3 0\nv 0 0 0.2\nf 1 3 2\nf 1 2 4\nf 1 4 "
                        "3\nf 2 3 4\n";
  const auto mesh = [&](const std::string& file) {
    return Swaps{{box, "<mesh filename=\"" + file + "\"/>"}};
  };
  return {
      Urdf("root link, a thruster on a fixed joint", {}),
      Urdf("thruster on a continuous joint", {{fixed, "type=\"continuous\""}}),
      Urdf("an arm on a continuous joint, a thruster's bracket",
           {{end,
             "<link name=\"arm\"/><joint name=\"turn\" type=\"continuous\"><parent "
             "link=\"base_link\"/><child link=\"arm\"/></joint><link "
             "name=\"thruster_mount\"/><joint "
             "name=\"mount\" type=\"fixed\"><parent link=\"base_link\"/><child "
             "link=\"thruster_mount\"/></joint></robot>"}}),
      Urdf("an arm on a revolute joint", {{fixed, "type=\"revolute\""}, {"thruster1", "arm"}}),
      Urdf("a joint of no type", {{fixed, ""}}),
      Urdf("link world, floating joint",
           {{end,
             "<link name=\"world\"/><joint name=\"float\" type=\"floating\"><parent "
             "link=\"world\"/><child link=\"base_link\"/></joint></robot>"}}),
      Urdf("link world, fixed joint",
           {{end,
             "<link name=\"world\"/><joint name=\"float\" type=\"fixed\"><parent "
             "link=\"world\"/><child link=\"base_link\"/></joint></robot>"}}),
      Urdf("an empty root link below it",
           {{end,
             "<link name=\"foot\"/><joint name=\"down\" type=\"fixed\"><parent "
             "link=\"foot\"/><child link=\"base_link\"/></joint></robot>"}}),
      Urdf("two links without a parent", {{end, "<link name=\"other\"/></robot>"}}),
      Urdf("parents in a circle",
           {{end,
             "<joint name=\"j\" type=\"fixed\"><parent link=\"thruster1\"/><child "
             "link=\"base_link\"/></joint></robot>"}}),
      Urdf("a joint of a link that is not there",
           {{"<parent link=\"base_link\"/>", "<parent link=\"hull\"/>"}}),
      Urdf("no mass", {{"<mass value=\"11.5\"/>", "<mass value=\"0\"/>"},
                       {"<mass value=\"0.3\"/>", "<mass value=\"0\"/>"}}),
      Urdf("a mass that is no number", {{"\"11.5\"", "\"heavy\""}}),
      Urdf("an inertia that no body has", {{"izz=\"0.25\"", "izz=\"2.5\""}}),
      Urdf("rpy in degrees", {{"1.5708 -0.785", "90 -45"}}),
      Urdf("<visual> only", {{"collision", "visual"}}),
      Urdf("mesh beside it", mesh("hull.obj"), {{"urdf/hull.obj", obj}}),
      Urdf("mesh of package://", mesh("package://rov/meshes/hull.obj"), {{"meshes/hull.obj", obj}}),
      Urdf("mesh of package://, by its name", mesh("package://rov/meshes/hull.obj"),
           {{"rov/meshes/hull.obj", obj}}),
      Urdf("mesh that is missing", mesh("package://rov/meshes/hull.obj")),
      Urdf("mesh .dae", mesh("package://rov/meshes/hull.dae")),
      Urdf("mesh .dae of a <visual>, a box of the <collision>",
           {{"<collision><geometry>" + box,
             "<visual><geometry><mesh filename=\"package://rov/hull.dae\"/></geometry></visual>"
             "<collision><geometry>" +
                 box}}),
      Urdf("mesh .dae of a <visual>, no <collision>",
           {{"<collision><geometry>" + box + "</geometry></collision>",
             "<visual><geometry><mesh filename=\"hull.dae\"/></geometry></visual>"}}),
      Urdf("mesh that is broken", mesh("hull.obj"), {{"urdf/hull.obj", "v 0 0 0\nf 1 2 3\n"}}),
      Urdf("geometry of no kind", {{box, "<cone/>"}}),
      Urdf("xacro", {{"\"11.5\"", "\"${mass}\""}}),
      Urdf("cut off", {{end, ""}}),
      {"SDF",
       "",
       "a.urdf",
       {{"a.urdf", "<sdf version=\"1.6\"><model/></sdf>"}},
       {"--mjcf", "out.xml"}},
      {"URDF", "without --mjcf", "a.urdf", {{"a.urdf", kUrdf}}},
      {"URDF", "called .xml", "a.xml", {{"a.xml", kUrdf}}},
  };
}

// ------------------------------------------------------------------------------------------- MJCF

Variant Vehicle(const std::string& name, const Swaps& swaps, const Swaps& in_data = {}) {
  const auto text = [](const char* file) { return system::ReadWhole(config::ModelPath(file)); };
  return {"vehicle",
          name,
          "a.xml",
          {{"a.xml", With(text("bluerov2_heavy.xml"), swaps)},
           {"a.yaml", With(text("bluerov2_heavy.yaml"), in_data)}}};
}

std::string T200() { return system::ReadWhole(config::AssetPath("thrusters/t200_16v.yaml")); }

// Data whose thrusters are as models/README.md has it.
std::string WithT200(std::string data) {
  const size_t begin = data.find("\nthrusters:") + 1, end = data.find("\n\n", begin) + 1;
  return data.erase(begin, end - begin) + T200();
}

std::vector<Variant> OfVehicles() {
  const auto text = [](const char* file) { return system::ReadWhole(config::ModelPath(file)); };
  const Swaps degrees = {{"0.7853981633974483", "45"}, {"1.5707963267948966", "90"}};
  const auto compiler = [](Swaps swaps, const std::string& attributes) {
    swaps.emplace_back("<mujoco>", "<mujoco><compiler " + attributes + "/>");
    return swaps;
  };
  const std::string hull = "name=\"hull_box\" class=\"solid\" type=\"box\" size=\"0.2285 0.2875 ",
                    free = "<freejoint name=\"vehicle\"/>", end = "</body>\n  </worldbody>";
  return {
      Vehicle("bundled", {}),
      Vehicle("degrees, without <compiler>", degrees),
      Vehicle("degrees, angle=\"degree\"", compiler(degrees, "angle=\"degree\"")),
      Vehicle("radians, angle=\"degree\"", compiler({}, "angle=\"degree\"")),
      Vehicle("eulerseq=\"zyx\", written for xyz", compiler({}, "eulerseq=\"zyx\"")),
      Vehicle("<compiler meshdir>", compiler({}, "meshdir=\"meshes\"")),
      Vehicle("free joint with stiffness",
              {{free, "<joint type=\"free\" name=\"vehicle\" stiffness=\"5\"/>"}}),
      Vehicle("free joint with damping",
              {{free, "<joint type=\"free\" name=\"vehicle\" damping=\"5\"/>"}}),
      Vehicle("hull ten times as large",
              {{hull + "0.127", With(hull, {{"0.2285 0.2875", "2.285 2.875"}}) + "1.27"}}),
      Vehicle("hull longer than the pole", {{hull, With(hull, {{"0.2285", "0.60"}})}}),
      Vehicle("a part before the cameras",
              {{end,
                "<geom name=\"hull_arm\" type=\"box\" size=\"0.01 0.2 0.2\" pos=\"0.3 0 "
                "0\"/>" +
                    end}}),
      Vehicle("a thruster in millimetres",
              {{"pos=\"0.156 0.111 -0.085\" euler", "pos=\"156 111 -85\" euler"}}),
      Vehicle("MJCF of another mass than the data", {{"mass=\"13.5\"", "mass=\"20\""}}),
      Vehicle("inertia in kg cm^2", {}, {{"[0.26, 0.23, 0.37]", "[2600, 2300, 3700]"}}),
      Vehicle("centre of buoyancy below", {}, {{"[0, 0, 0.01]", "[0, 0, -0.03]"}}),
      Vehicle("no thruster that gives sway", {{"euler=\"0 0 -0.7853981633974483\"/>", "/>"},
                                              {"euler=\"0 0 0.7853981633974483\"/>", "/>"}}),
      Vehicle("volts in microseconds", {}, {{"table_volts: [0, ", "table_volts: [1100, "}}),
      {"vehicle",
       "thrusters by the maker's table of the T200",
       "a.xml",
       {{"a.xml", text("bluerov2_heavy.xml")}, {"a.yaml", WithT200(text("bluerov2_heavy.yaml"))}}},
      {"vehicle",
       "without data",
       "a.xml",
       {{"a.xml", system::ReadWhole(config::ModelPath("bluerov2_heavy.xml"))}}},
      {"whole MJCF",
       "of MuJoCo 2",
       "a.xml",
       {{"a.xml", "<mujoco><worldbody><geom size=\"1\"/></worldbody></mujoco>"}}},
      {"whole MJCF",
       "of MuJoCo 3",
       "a.xml",
       {{"a.xml", "<mujoco>\n<option integrator=\"implicitfast\"/></mujoco>"}}},
      {"whole MJCF", "cut off", "a.xml", {{"a.xml", "<mujoco>\n<option"}}},
      {"whole MJCF", "--mjcf", "a.xml", {{"a.xml", "<mujoco/>"}}, {"--mjcf", "out.xml"}},
  };
}

Variant Station(const std::string& name, const Swaps& swaps,
                const std::vector<std::string>& assignments = {}) {
  std::vector<std::string> arguments = {"--set", "trial.scene=scene.xml"};
  for (const std::string& assignment : assignments) {
    arguments.emplace_back("--set");
    arguments.push_back(assignment);
  }
  return {
      "station",
      name,
      "vehicle.xml",
      {{"scene.xml", With(system::ReadWhole(config::ModelPath("sea_active.xml")),
                          {{"marker_active.xml", "my_marker.xml"}})},
       {"my_marker.xml", With(system::ReadWhole(config::ModelPath("marker_active.xml")), swaps)}},
      arguments};
}

std::vector<Variant> OfStations() {
  const std::string body = "<body name=\"marker\"";
  const Swaps off = {{body, body + " pos=\"0 0.08 0.04\""}};
  const Swaps colour = {{"ball_red", "ball_violet"}, {"0.40 0.012 0.012", "0.22 0.012 0.40"}};
  return {
      Station("of its own", {}),
      Station("marker 8 cm aside, 4 cm up", off),
      Station("the same, procedure.servo_y_m=0.08, servo_z_m=0.04", off,
              {"procedure.servo_y_m=0.08", "procedure.servo_z_m=0.04"}),
      Station("a ball whose light is missing", colour),
      Station("the same, without lights", colour, {"lights.marker.enabled=false"}),
  };
}

// ---------------------------------------------------------------------------------------- outcomes

std::string OutcomeOf(const Variant& variant, const std::filesystem::path& folder) {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  for (const auto& [name, text] : variant.files) {
    std::filesystem::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text;
  }
  std::vector<std::string> arguments = {
      "check-vehicle",
      variant.file == "vehicle.xml" ? variant.file : (folder / variant.file).string(), "--json"};
  for (std::string argument : variant.arguments) {
    if (argument == "out.xml") argument = (folder / argument).string();
    if (argument == "trial.scene=scene.xml")
      argument = "trial.scene=" + (folder / "scene.xml").string();
    arguments.push_back(argument);
  }
  const testing::ProgramEnd end = testing::RunProgram(arguments);
  std::string outcome;
  if (end.out.empty()) {
    outcome = end.err;
  } else {
    const auto result = nlohmann::json::parse(end.out);
    outcome = result.at("problems").empty() ? "ready to dock" : "not ready";
    for (const char* list : {"problems", "warnings"})
      for (const std::string text : result.at(list)) outcome += ": " + text;
  }
  outcome = With(
      outcome + folder.string() + "/turbidock: " + "\n" + config::ModelPath(""),
      {{folder.string() + "/", ""}, {"turbidock: ", ""}, {"\n", " "}, {config::ModelPath(""), ""}});
  while (outcome.ends_with(' ')) outcome.pop_back();
  EXPECT_NE(end.exit_code, 4) << end.err;
  return std::to_string(end.exit_code) + " | " + outcome;
}

// Full power, the dead band and a row of the table, by the formula of models/README.md.
TEST(T200, GivesWhatTheMakersTableSays) {
  const auto thrusters =
      config::LoadLayers<vehicle::VehicleData>({config::AssetPath("thrusters/t200_16v.yaml")}, {})
          .thrusters;
  for (const auto& [pwm_us, kgf] : {std::pair{1100, -4.069476},
                                    {1472, 0.0},
                                    {1500, 0.0},
                                    {1528, 0.0},
                                    {1620, 0.816466},
                                    {1900, 5.245035}})
    EXPECT_NEAR(thrusters.Thrust((pwm_us - 1100) / 160.0), kgf * 9.80665, 0.005) << pwm_us;
}

TEST(VehicleFiles, AreTakenOrRefusedAsTheTableSays) {
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / "vehicles_of_others";
  std::string table = "| What | Variant | Exit code | Outcome |\n|---|---|---|---|\n";
  for (const std::vector<Variant>& variants : {OfUrdf(), OfVehicles(), OfStations()})
    for (const Variant& variant : variants)
      table +=
          "| " + variant.kind + " | " + variant.name + " | " + OutcomeOf(variant, folder) + " |\n";
  // no tags of the page
  for (size_t at; (at = table.find('<')) != std::string::npos;) table.replace(at, 1, "&lt;");
  testing::ExpectDrawn("vehicles.txt", table);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace turbidock::check_vehicle
