#include "sim/vehicle/scene.h"

#include <array>
#include <new>
#include <string_view>

#include "sim/base/check.h"
#include "sim/base/frames.h"
#include "sim/base/units.h"
#include "sim/vehicle/mujoco_handlers.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr std::array kThrusterNames = {"surge_left", "surge_right", "sway", "heave"};

const char* NameOfType(mjtObj type) {
  switch (type) {
    case mjOBJ_BODY:
      return "body";
    case mjOBJ_GEOM:
      return "geom";
    case mjOBJ_SITE:
      return "site";
    case mjOBJ_CAMERA:
      return "camera";
    default:
      return "actuator";
  }
}

Pose PoseFrom(const mjtNum* p, const mjtNum* row_major_rotation) {
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  return {Quaterniond(Matrix3d(Eigen::Map<const RowMajor>(row_major_rotation))),
          Eigen::Map<const Vector3d>(p)};
}

MjModelPtr ReadModel(const std::string& path) {
  std::array<char, 1024> message{};
  MjModelPtr model(mj_loadXML(path.c_str(), nullptr, message.data(), message.size()));
  // A message beside a model is a warning: a file of ours must not have any.
  if (!model && std::string(message.data()).find("allocate") != std::string::npos)
    throw std::bad_alloc();  // the machine's fault, not the file's
  if (!model || message[0] != '\0') throw ConfigError(path + ": " + message.data());
  return model;
}

// Looks names up in a model and says, with the file's name, what is missing or misplaced.
class Contract {
 public:
  Contract(const mjModel& model, const std::string& path) : model_(model), path_(path) {}

  int Find(mjtObj type, const std::string& name) const {
    const int id = mj_name2id(&model_, type, name.c_str());
    Require(id >= 0, "no " + std::string(NameOfType(type)) + " named \"" + name + "\"");
    return id;
  }

  int FindSite(const std::string& name, int body) const {
    const int site = Find(mjOBJ_SITE, name);
    Require(model_.site_bodyid[site] == body,
            "site \"" + name + "\" must belong to body \"" + Name(mjOBJ_BODY, body) + "\"");
    return site;
  }

  int FindCamera(const std::string& name, int body) const {
    const int camera = Find(mjOBJ_CAMERA, name);
    Require(model_.cam_bodyid[camera] == body && model_.cam_mode[camera] == mjCAMLIGHT_FIXED,
            "camera \"" + name + "\" must be fixed in body \"" + Name(mjOBJ_BODY, body) + "\"");
    return camera;
  }

  // A body that stands still in the world.
  int FindStaticBody(const std::string& name) const {
    const int body = Find(mjOBJ_BODY, name);
    Require(model_.body_weldid[body] == 0, "body \"" + name + "\" must not have joints");
    return body;
  }

  int FindVehicle() const {
    const int body = Find(mjOBJ_BODY, "vehicle");
    Require(model_.body_jntnum[body] == 1 && model_.body_parentid[body] == 0 &&
                model_.jnt_type[model_.body_jntadr[body]] == mjJNT_FREE,
            "body \"vehicle\" must have one free joint");
    return body;
  }

  int FindThruster(const std::string& name, int vehicle_body) const {
    const int actuator = Find(mjOBJ_ACTUATOR, name);
    const mjtNum* gear = model_.actuator_gear + 6 * actuator;
    bool pushes_along_x = model_.actuator_trntype[actuator] == mjTRN_SITE && gear[0] == 1;
    for (int i = 1; i < 6; ++i) pushes_along_x = pushes_along_x && gear[i] == 0;
    Require(
        pushes_along_x && model_.site_bodyid[model_.actuator_trnid[2 * actuator]] == vehicle_body,
        "actuator \"" + name + "\" must push along the x axis of a site of the vehicle");
    return actuator;
  }

  std::string Name(mjtObj type, int id) const {
    const char* name = mj_id2name(&model_, type, id);
    return name ? name : "";
  }

  void Require(bool condition, const std::string& problem) const {
    if (!condition) throw ConfigError(path_ + ": " + problem);
  }

 private:
  const mjModel& model_;
  const std::string& path_;
};

// What each geom is part of: its body says which parts there may be, its name which one it is.
std::vector<Part> ClassifyGeoms(const Scene& scene, const Contract& contract) {
  const mjModel& m = *scene.model;
  std::vector<Part> parts(m.ngeom, Part::kEnvironment);
  int hulls = 0, poles = 0, docks = 0;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    const std::string name = contract.Name(mjOBJ_GEOM, geom);
    const auto is = [&](std::string_view prefix) { return name.starts_with(prefix); };
    const int body = m.geom_bodyid[geom];
    bool known = true;
    if (body == scene.vehicle_body) {
      parts[geom] = name == "pole" ? Part::kPole : Part::kHull;
      known = is("hull_") || name == "pole";
    } else if (body == scene.marker_body) {
      parts[geom] = Part::kMarker;
      known = is("marker_") || is("ball_");
    } else if (body == scene.station_body) {
      parts[geom] = is("dock_") ? Part::kDock : Part::kStation;
      known = is("station_") || is("dock_");
    }
    contract.Require(known, "body \"" + contract.Name(mjOBJ_BODY, body) +
                                "\" must not have a geom named \"" + name + "\"");
    hulls += parts[geom] == Part::kHull;
    poles += parts[geom] == Part::kPole;
    docks += parts[geom] == Part::kDock;
  }
  contract.Require(hulls > 0, "the vehicle has no geom hull_*");
  contract.Require(poles > 0, "the vehicle has no geom \"pole\"");
  contract.Require(docks > 0, "the station has no geom dock_*");
  return parts;
}

std::vector<BallInScene> FindBalls(const Scene& scene, const mjData& d, const Contract& contract) {
  const mjModel& m = *scene.model;
  constexpr std::string_view kPrefix = "ball_";
  std::vector<BallInScene> balls;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    const std::string name = contract.Name(mjOBJ_GEOM, geom);
    if (m.geom_bodyid[geom] != scene.marker_body || !name.starts_with(kPrefix)) continue;
    contract.Require(m.geom_type[geom] == mjGEOM_SPHERE, "geom \"" + name + "\" must be a sphere");
    const Vector3d p_WQ = Eigen::Map<const Vector3d>(d.geom_xpos + 3 * geom);
    balls.push_back({.name = name.substr(kPrefix.size()),
                     .geom = geom,
                     .p_MQ = scene.X_WM.Inverse() * p_WQ,
                     .radius_m = m.geom_size[3 * geom]});
  }
  contract.Require(!balls.empty(), "the marker has no geom ball_*");
  return balls;
}

// Puts a camera where the rig says: X_HC is the pose of its optical frame in the head.
void PlaceCamera(const Pose& X_BH, const Pose& X_HC, const CameraIntrinsics& intrinsics, int camera,
                 mjModel* m) {
  const Pose X_BC = X_BH * X_HC;
  const Quaterniond q_BG = X_BC.q * Quaterniond(OpticalFromMujocoCamera());
  Eigen::Map<Vector3d>(m->cam_pos + 3 * camera) = X_BC.p;
  mjtNum* quat = m->cam_quat + 4 * camera;
  quat[0] = q_BG.w();
  quat[1] = q_BG.x();
  quat[2] = q_BG.y();
  quat[3] = q_BG.z();
  m->cam_fovy[camera] = units::DegFromRad(intrinsics.vertical_fov_rad());
}

}  // namespace

Scene LoadScene(const std::string& mjcf_path, const RigParams& rig) {
  InstallMujocoHandlers();
  CheckFields(rig, "rig");
  Scene scene;
  scene.model = ReadModel(mjcf_path);
  scene.rig = rig.MakeRig();
  mjModel* m = scene.model.get();
  const Contract contract(*m, mjcf_path);

  scene.vehicle_body = contract.FindVehicle();
  scene.marker_body = contract.FindStaticBody("marker");
  scene.station_body = contract.FindStaticBody("station");
  scene.camera_head_site = contract.FindSite("camera_head", scene.vehicle_body);
  scene.pole_tip_site = contract.FindSite("pole_tip", scene.vehicle_body);
  scene.marker_site = contract.FindSite("marker", scene.marker_body);
  scene.dock_mouth_site = contract.FindSite("dock_mouth", scene.station_body);
  scene.dock_throat_site = contract.FindSite("dock_throat", scene.station_body);
  for (const char* name : {"lamp_left", "lamp_right"})
    scene.lamp_sites.push_back(contract.FindSite(name, scene.vehicle_body));
  for (const char* name : kThrusterNames)
    scene.thruster_actuators.push_back(contract.FindThruster(name, scene.vehicle_body));
  scene.left_camera = contract.FindCamera("left", scene.vehicle_body);
  scene.right_camera = contract.FindCamera("right", scene.vehicle_body);
  scene.spectator_camera = contract.FindCamera("spectator", 0);
  scene.geom_part = ClassifyGeoms(scene, contract);

  const MjDataPtr d(mj_makeData(m));
  mj_kinematics(m, d.get());
  scene.X_BH = BodyPose(*d, scene.vehicle_body).Inverse() * SitePose(*d, scene.camera_head_site);
  scene.X_WM = SitePose(*d, scene.marker_site);
  scene.X_WD = SitePose(*d, scene.dock_mouth_site);
  scene.balls = FindBalls(scene, *d, contract);
  scene.p_HQ_pole_tip =
      SitePose(*d, scene.camera_head_site).Inverse() * SitePose(*d, scene.pole_tip_site).p;

  const Pose X_DT = scene.X_WD.Inverse() * SitePose(*d, scene.dock_throat_site);
  constexpr double kAlignedTol_m = 1e-6, kAlignedTol_rad = 1e-6;
  contract.Require(X_DT.p.x() > 0 && X_DT.p.tail<2>().norm() < kAlignedTol_m &&
                       AngleBetween(X_DT.q, Quaterniond::Identity()) < kAlignedTol_rad,
                   "site \"dock_throat\" must lie straight ahead of \"dock_mouth\", with its axes");
  const mjtNum* throat_size = m->site_size + 3 * scene.dock_throat_site;
  contract.Require(
      m->site_type[scene.dock_throat_site] == mjGEOM_BOX && throat_size[1] == throat_size[2],
      "site \"dock_throat\" must be a box as wide as it is high");
  scene.dock_throat_depth_m = X_DT.p.x();
  scene.dock_throat_half_width_m = throat_size[1];

  PlaceCamera(scene.X_BH, scene.rig.left.X_HC, scene.rig.left, scene.left_camera, m);
  PlaceCamera(scene.X_BH, scene.rig.right.X_HC, scene.rig.right, scene.right_camera, m);
  return scene;
}

Pose SitePose(const mjData& d, int site) {
  return PoseFrom(d.site_xpos + 3 * site, d.site_xmat + 9 * site);
}

Pose BodyPose(const mjData& d, int body) {
  const mjtNum* q = d.xquat + 4 * body;
  return {Quaterniond(q[0], q[1], q[2], q[3]), Eigen::Map<const Vector3d>(d.xpos + 3 * body)};
}

}  // namespace turbidock::vehicle
