#include "experiments/page/trial_page.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <utility>
#include <vector>

#include "experiments/report/report_json.h"
#include "experiments/system/base64.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "experiments/trial/trace_panels.h"
#include "experiments/trial/trial.h"
#include "experiments/trial/trial_report.h"

namespace turbidock::page {
namespace {

namespace fs = std::filesystem;
using report::Json;

// In the order of vehicle::Part.
constexpr std::array kPartNames = {"environment", "hull", "pole", "marker", "station", "dock"};

// Empty for a geom that is not drawn.
std::string ShapeName(int type) {
  static const std::map<int, std::string> kNames = {
      {mjGEOM_PLANE, "plane"},       {mjGEOM_SPHERE, "sphere"},
      {mjGEOM_CAPSULE, "capsule"},   {mjGEOM_ELLIPSOID, "ellipsoid"},
      {mjGEOM_CYLINDER, "cylinder"}, {mjGEOM_BOX, "box"},
      {mjGEOM_MESH, "mesh"}};
  const auto found = kNames.find(type);
  return found == kNames.end() ? "" : found->second;
}

// The first numbers of an array of MuJoCo's.
template <class T>
Json Numbers(const T* values, int count) {
  return Rounded(std::vector<T>(values, values + count));
}

Json MeshModel(const mjModel& m, int mesh) {
  const int* f = m.mesh_face + 3L * m.mesh_faceadr[mesh];
  return {
      {"vertices_m", Numbers(m.mesh_vert + 3L * m.mesh_vertadr[mesh], 3 * m.mesh_vertnum[mesh])},
      {"triangles", std::vector<int>(f, f + 3 * m.mesh_facenum[mesh])}};
}

Pose PoseOf(const mjtNum* p, const mjtNum* R) {
  const Eigen::Matrix3d rows = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R);
  return {Eigen::Quaterniond(rows), {p[0], p[1], p[2]}};
}

Json RigModel(const StereoRig& rig) {
  const auto camera = [](const MountedCamera& c) {
    return Json{{"fx_px", c.fx_px},
                {"fy_px", c.fy_px},
                {"cx_px", c.cx_px},
                {"cy_px", c.cy_px},
                {"X_HC", PoseModel(c.X_HC)}};
  };
  return {{"width_px", rig.left.width_px},
          {"height_px", rig.left.height_px},
          {"left", camera(rig.left)},
          {"right", camera(rig.right)}};
}

// Key frames, "cameras/000090_left.jpg" beside "000090_right.jpg": of frame 90.
Json PicturesIn(const fs::path& folder, const trial::Scenario& scenario) {
  std::map<int, Json> pictures;  // by frame
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string(), number = name.substr(0, 6);
    const fs::path right = folder / (number + "_right.jpg");
    if (!name.ends_with("_left.jpg") || !fs::exists(right) ||
        number.find_first_not_of("0123456789") != std::string::npos)
      continue;
    const int frame = std::stoi(number);
    pictures[frame] = {{"time_s", Rounded(scenario.clock.TimeOfFrame(frame))},
                       {"left", system::Base64(system::ReadWhole(entry.path()))},
                       {"right", system::Base64(system::ReadWhole(right))}};
  }
  Json list = Json::array();
  for (auto& [frame, picture] : pictures) list.push_back(std::move(picture));
  return list;
}

}  // namespace

Json Rounded(Json json, int digits) {
  if (json.is_structured())
    for (Json& inner : json) inner = Rounded(std::move(inner), digits);
  else if (json.is_number_float() && std::isfinite(json.get<double>()))
    json = std::strtod(fmt::format("{:.{}g}", json.get<double>(), digits).c_str(), nullptr);
  return json;
}

Json PoseModel(const Pose& pose) {
  const Pose X = pose.Canonical();
  return Rounded({X.p.x(), X.p.y(), X.p.z(), X.q.w(), X.q.x(), X.q.y(), X.q.z()});
}

Json SceneModel(const vehicle::Scene& scene) {
  const mjModel& m = *scene.model;
  const vehicle::MjDataPtr data(mj_makeData(&m));
  mj_kinematics(&m, data.get());
  const int vehicle = scene.vehicle_body;
  const Pose X_VW = vehicle::BodyPose(*data, vehicle).Inverse();
  const Pose X_MW = scene.X_WM.Inverse();  // the moored body's geoms are told in the marker's frame
  Json geoms = Json::array(), meshes = Json::array();
  for (int g = 0; g < m.ngeom; ++g) {
    const std::string shape = ShapeName(m.geom_type[g]);
    if (m.geom_group[g] == vehicle::kContactsOnlyGroup || shape.empty()) continue;
    const int root = m.body_rootid[m.geom_bodyid[g]];
    const bool on_vehicle = root == m.body_rootid[vehicle];
    const bool in_moored_body = root == scene.moored_body.body;
    const Pose X_WG = PoseOf(data->geom_xpos + 3L * g, data->geom_xmat + 9L * g);
    const char* name = mj_id2name(&m, mjOBJ_GEOM, g);
    Json geom = {{"name", name ? name : ""},
                 {"part", kPartNames[static_cast<size_t>(scene.geom_part[static_cast<size_t>(g)])]},
                 {"fixed_to", on_vehicle       ? "vehicle"
                              : in_moored_body ? "moored_body"
                                               : "world"},
                 {"shape", shape},
                 {"size_m", Numbers(m.geom_size + 3L * g, 3)},
                 {"pose", PoseModel(on_vehicle       ? X_VW * X_WG
                                    : in_moored_body ? X_MW * X_WG
                                                     : X_WG)},
                 {"rgba", Numbers(m.geom_rgba + 4L * g, 4)}};
    if (shape == "mesh") {
      geom["mesh"] = meshes.size();
      meshes.push_back(MeshModel(m, m.geom_dataid[g]));
    }
    geoms.push_back(geom);
  }
  return {{"X_BH", PoseModel(scene.X_BH)},
          {"X_WM", PoseModel(scene.X_WM)},
          {"X_WD", PoseModel(scene.X_WD)},
          {"geoms", geoms},
          {"meshes", meshes}};
}

Json TrialModel(const trial::Scenario& scenario) {
  Json model = {
      {"kind", "trial"},
      {"title", trial::TitleOf(scenario)},
      {"seed", std::to_string(scenario.seed)},
      {"frames_per_second", scenario.clock.frames_per_second},
      {"limits", trial::CriteriaOf(scenario)},
      {"sight_m", Rounded(trial::Sight_m(scenario), 3)},
      {"night", scenario.faults.ambient_light.empty()},
      {"rig", RigModel(scenario.rig.MakeRig())},
      {"marker",
       {{"balls", scenario.marker.balls}, {"outer_ring_ratio", scenario.marker.outer_ring_ratio}}},
      {"scene", nullptr},
      {"missing", Json::array()}};
  try {
    model["scene"] = SceneModel(vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig));
  } catch (const ConfigError& error) {
    model["missing"].push_back(fmt::format("No 3D replay: {}", error.what()));
  }
  return model;
}

// Of curves: a time, too, must find its frame.
constexpr int kPlotDigits = 6;

Json SeriesModel(const trial::Series& series, int digits) {
  return system::Base64(series.Rounded(digits).Bytes());
}

Json TracesModel(const trial::Series& series, const trial::ViewCriteria& criteria, int digits,
                 size_t first_row) {
  return {{"series", SeriesModel(series.From(first_row), digits)},
          {"sections", Rounded(trial::TraceSections(series, criteria, first_row), kPlotDigits)}};
}

Page TrialPage(const std::string& folder, const trial::Plugins& plugins) {
  const fs::path in(folder);
  std::error_code none;
  if (!fs::is_directory(in, none)) throw ConfigError(folder + ": no such folder");
  for (const std::string& name : trial::kRecordFiles)
    if (!fs::is_regular_file(in / name, none))
      throw ConfigError(fmt::format("{}: is no trial's folder: it has no {}", folder, name));
  const std::string result = (in / "result.json").string(),
                    trajectory = (in / "trajectory.csv").string(),
                    resolved = (in / "resolved.yaml").string(), video = (in / "video.mp4").string();
  const trial::Scenario scenario =
      trial::ParseScenario(system::ReadWhole(resolved), resolved, plugins);
  const Json record = report::ParseJson(system::ReadWhole(result), result);
  if (!record.is_object() || !record.contains("outcome"))
    throw ConfigError(result + ": is no trial's result");
  const auto series = trial::Series::FromCsv(system::ReadWhole(trajectory), trajectory);
  report::Report report = trial::ReportOf(scenario, record, series);
  report.sections.push_back(
      {.title = "Again",
       .commands = {{"The same trial again, filmed",
                     fmt::format("{} run {} --out again --video", plugins.program(),
                                 system::ShellWord(resolved))}}});
  Page page;
  page.model = TrialModel(scenario);
  for (const Json& sentence : page.model["missing"]) report.missing.push_back(sentence);
  page.model.update(Rounded(report));
  page.model.update({{"series", SeriesModel(series, kPlotDigits)},
                     {"frames", PicturesIn(in / "cameras", scenario)}});
  if (fs::is_regular_file(video, none)) page.files["video"] = system::ReadWhole(video);
  page.has_3d = !page.model["scene"].is_null();
  return page;
}

}  // namespace turbidock::page
