#include "sim/vehicle/scene.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "sim/base/check.h"
#include "sim/base/frames.h"
#include "sim/base/thruster_command.h"
#include "sim/base/units.h"
#include "sim/vehicle/mujoco_handlers.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr ModelName kModelNames[] = {
    {"vehicle", "body", "vehicle", "the vehicle, with one free joint; frame B, x forward, z up"},
    {"vehicle", "site", "camera_head",
     "frame H, as B: midway between the two cameras, which look along its x"},
    {"vehicle", "camera", "left", "fixed in the vehicle; the rig's data say where and how wide"},
    {"vehicle", "camera", "right", "likewise"},
    {"vehicle", "site", "lamp_left", "a lamp, its beam along the site's x"},
    {"vehicle", "site", "lamp_right", "likewise"},
    {"vehicle", "site", "pole_tip", "foremost point of the docking pole"},
    {"vehicle", "geom", "pole", "the docking pole"},
    {"vehicle", "geom", "hull_*", "everything else of the vehicle; there is no other geom"},
    {"vehicle", "motor", "*",
     "1 to 16 thrusters, each at a site of its own that it pushes along the x axis of"},
    {"marker", "body", "marker", "the marker, without joints of its own"},
    {"marker", "site", "marker", "frame M, its axes as H's when the vehicle faces it squarely"},
    {"marker", "geom", "ball_*",
     "a ball, a sphere; what follows ball_ is what its colour is called"},
    {"marker", "geom", "marker_*", "everything else of the marker"},
    {"station", "body", "station", "the station, without joints of its own"},
    {"station", "site", "dock_mouth", "frame D: the mouth's middle, x where the pole goes in"},
    {"station", "site", "dock_throat",
     "where the straight hole begins, axes as D: a box whose half sizes in y and z are the hole's"},
    {"station", "geom", "dock_*", "what the pole may touch"},
    {"station", "geom", "station_*", "everything else of the station"},
    {"tags", "site", "tag_*",
     "where there are any: a fiducial tag, fixed to the marker, named by its number; a box whose "
     "half sizes in y and z are those of its black square; x into it, z up as it is printed"},
    {"moored body", "joint", "mooring_x",
     "slides the body that holds station and marker along W's x, as station.mooring.* says; needed "
     "where "
     "it does"},
    {"moored body", "joint", "mooring_y", "likewise along W's y"},
    {"moored body", "joint", "mooring_yaw", "turns it about W's z; the last of its joints"},
    {"world", "camera", "spectator", "the view from outside"},
    {"world", "geom", "*", "surroundings, such as floor and wall_left"},
};

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

Quaterniond QuaternionAt(const mjtNum* values, int index) {
  const mjtNum* q = values + 4 * static_cast<ptrdiff_t>(index);
  return {q[0], q[1], q[2], q[3]};
}

// Looks names up in a model and says, with the file's name, what is missing or misplaced.
class Contract {
 public:
  Contract(const mjModel& model, const std::string& path) : model_(model), path_(path) {}

  int Find(mjtObj type, const std::string& name) const {
    const int id = mj_name2id(&model_, type, name.c_str());
    if (id >= 0) return id;
    std::string meaning;
    for (const ModelName& known : kModelNames)
      if (known.name == name && std::string_view(known.kind) == NameOfType(type))
        meaning = std::string(" (") + known.meaning + ")";
    Require(false, "no " + std::string(NameOfType(type)) + " named \"" + name + "\"" + meaning);
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

  // A body that is fixed to the world or to the moored body.
  int FindAttached(const std::string& name, const MooredBody& moored_body) const {
    const int body = Find(mjOBJ_BODY, name);
    const int fixed_to = std::max(moored_body.body, 0);
    Require(model_.body_weldid[body] == fixed_to,
            fixed_to == 0
                ? "body \"" + name + "\" must not have joints"
                : "body \"" + name + "\" must be fixed in the body with the mooring's joints");
    return body;
  }

  // The body with the mooring's joints; none is allowed.
  MooredBody FindMooredBody() const {
    MooredBody moored_body;
    constexpr const char* kNames[] = {"mooring_x", "mooring_y", "mooring_yaw"};
    int before = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const char* name = kNames[axis];
      const int joint = mj_name2id(&model_, mjOBJ_JOINT, name);
      if (joint < 0) continue;
      moored_body.joints[axis] = joint;
      const std::string called = "joint \"" + std::string(name) + "\"";
      const int body = model_.jnt_bodyid[joint];
      Require(moored_body.body < 0 || moored_body.body == body,
              called + " must belong to the body of the mooring's other joints");
      moored_body.body = body;
      Require(joint > before, called + " must come after the others: x, y, yaw");
      before = joint;
      Require(model_.body_parentid[body] == 0 &&
                  QuaternionAt(model_.body_quat, body).coeffs() == Quaterniond::Identity().coeffs(),
              called + " must belong to a body of the world, unturned");
      const bool is_yaw = axis == 2;
      const Vector3d along = is_yaw ? Vector3d::UnitZ() : Vector3d::Unit(axis);
      Require(
          model_.jnt_type[joint] == (is_yaw ? mjJNT_HINGE : mjJNT_SLIDE) &&
              Vector3d::Map(model_.jnt_axis + 3 * joint) == along,
          called + (is_yaw ? " must be a hinge about 0 0 1"
                           : " must slide along " + std::string(axis == 0 ? "1 0 0" : "0 1 0")));
      const int dof = model_.jnt_dofadr[joint];
      Require(!model_.jnt_limited[joint] && model_.jnt_stiffness[joint] == 0 &&
                  model_.dof_damping[dof] == 0 && model_.dof_frictionloss[dof] == 0 &&
                  model_.qpos0[model_.jnt_qposadr[joint]] == 0,
              called + " must be free: no limits, stiffness, damping, friction or ref");
    }
    Require(moored_body.body < 0 ||
                model_.body_jntnum[moored_body.body] ==
                    std::ranges::count_if(moored_body.joints, [](int j) { return j >= 0; }),
            "the body with the mooring's joints must have no others");
    return moored_body;
  }

  // What is fixed to it may have sites and a mass, which gives way to the data's; what moved or was
  // touched besides would have no water about it and no name.
  void RequireOneBody(int vehicle_body) const {
    for (int body = 1; body < model_.nbody; ++body) {
      const bool is_part = body != vehicle_body && model_.body_rootid[body] == vehicle_body;
      Require(!is_part || (model_.body_jntnum[body] == 0 && model_.body_geomnum[body] == 0),
              "body \"" + Name(mjOBJ_BODY, body) +
                  "\" must not have joints or geoms: the vehicle is one body");
    }
  }

  int FindVehicle() const {
    const int body = Find(mjOBJ_BODY, "vehicle");
    Require(model_.body_jntnum[body] == 1 && model_.body_parentid[body] == 0 &&
                model_.jnt_type[model_.body_jntadr[body]] == mjJNT_FREE,
            "body \"vehicle\" must have one free joint");
    Require(model_.jnt_stiffness[model_.body_jntadr[body]] == 0,
            "the vehicle's free joint must have no stiffness, a spring to the world's origin: "
            "leave it out");
    return body;
  }

  // All of the model's motors.
  std::vector<ThrusterInScene> FindThrusters(int vehicle_body) const {
    std::vector<ThrusterInScene> thrusters;
    std::map<int, std::string> at_site;
    Require(1 <= model_.nu && model_.nu <= kMaxThrusters,
            "has " + std::to_string(model_.nu) + " motors, must have 1 to " +
                std::to_string(kMaxThrusters) + ": the vehicle's thrusters");
    for (int actuator = 0; actuator < model_.nu; ++actuator) {
      const std::string name = Name(mjOBJ_ACTUATOR, actuator);
      Require(!name.empty(), "motor " + std::to_string(actuator) + " has no name");
      constexpr std::string_view kAllowed =
          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
      Require(name.find_first_not_of(kAllowed) == std::string::npos,
              "motor \"" + name + "\" must have a name of letters, digits and underscores");
      const mjtNum* gear = model_.actuator_gear + 6 * actuator;
      bool pushes_along_x = model_.actuator_trntype[actuator] == mjTRN_SITE && gear[0] == 1;
      for (int i = 1; i < 6; ++i) pushes_along_x = pushes_along_x && gear[i] == 0;
      const int site = model_.actuator_trnid[2 * actuator];
      Require(pushes_along_x && model_.site_bodyid[site] == vehicle_body,
              "motor \"" + name + "\" must push along the x axis of a site of the vehicle");
      const int reference = model_.actuator_trnid[2 * actuator + 1];
      Require(reference < 0, "motor \"" + name + "\" must push at one site, but names \"" +
                                 Name(mjOBJ_SITE, site) + "\" and, as its refsite, \"" +
                                 Name(mjOBJ_SITE, reference) + "\"");
      const auto [other, is_first] = at_site.emplace(site, name);
      Require(is_first, "motors \"" + other->second + "\" and \"" + name +
                            "\" must not share the site \"" + Name(mjOBJ_SITE, site) + "\"");
      thrusters.push_back(ThrusterAt(model_, actuator));
    }
    return thrusters;
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

std::span<const ModelName> ModelNames() { return kModelNames; }

MjModelPtr LoadModel(const std::string& path) {
  InstallMujocoHandlers();
  return ReadModel({path});
}

std::vector<ModelName> LackingVehicleNames(const mjModel& model) {
  constexpr std::pair<std::string_view, mjtObj> kTypes[] = {
      {"body", mjOBJ_BODY}, {"site", mjOBJ_SITE}, {"camera", mjOBJ_CAMERA}, {"geom", mjOBJ_GEOM}};
  const auto has = [&](const ModelName& wanted) {
    const std::string_view name = wanted.name;
    if (name == "*") return model.nu > 0;
    for (const auto& [kind, type] : kTypes) {
      if (kind != wanted.kind) continue;
      if (!name.ends_with('*')) return mj_name2id(&model, type, wanted.name) >= 0;
      for (int geom = 0; geom < model.ngeom; ++geom) {
        const char* own = mj_id2name(&model, type, geom);
        if (own && std::string_view(own).starts_with(name.substr(0, name.size() - 1))) return true;
      }
    }
    return false;
  };
  std::vector<ModelName> lacking;
  for (const ModelName& wanted : kModelNames)
    if (std::string_view(wanted.of) == "vehicle" && !has(wanted)) lacking.push_back(wanted);
  return lacking;
}

ThrusterInScene ThrusterAt(const mjModel& m, int actuator) {
  const char* name = mj_id2name(&m, mjOBJ_ACTUATOR, actuator);
  const int site = m.actuator_trnid[2 * actuator];
  return {.name = name ? name : "",
          .actuator = actuator,
          .p_BT = Vector3d::Map(m.site_pos + 3 * site),
          .axis_B = QuaternionAt(m.site_quat, site) * Vector3d::UnitX()};
}

std::vector<std::string> NamesOf(const std::vector<ThrusterInScene>& thrusters) {
  std::vector<std::string> names;
  names.reserve(thrusters.size());
  for (const ThrusterInScene& thruster : thrusters) names.push_back(thruster.name);
  return names;
}

Scene LoadScene(const SceneFiles& files, const RigParams& rig) {
  InstallMujocoHandlers();
  CheckFields(rig, "cameras.rig");
  Scene scene;
  scene.model = ReadModel(files);
  scene.rig = rig.MakeRig();
  mjModel* m = scene.model.get();
  const std::string where = Where(files);
  const Contract contract(*m, where);

  scene.vehicle_body = contract.FindVehicle();
  scene.moored_body = contract.FindMooredBody();
  scene.marker_body = contract.FindAttached("marker", scene.moored_body);
  scene.station_body = contract.FindAttached("station", scene.moored_body);
  scene.camera_head_site = contract.FindSite("camera_head", scene.vehicle_body);
  scene.pole_tip_site = contract.FindSite("pole_tip", scene.vehicle_body);
  scene.marker_site = contract.FindSite("marker", scene.marker_body);
  scene.dock_mouth_site = contract.FindSite("dock_mouth", scene.station_body);
  scene.dock_throat_site = contract.FindSite("dock_throat", scene.station_body);
  for (const char* name : {"lamp_left", "lamp_right"})
    scene.lamp_sites.push_back(contract.FindSite(name, scene.vehicle_body));
  scene.thrusters = contract.FindThrusters(scene.vehicle_body);
  scene.left_camera = contract.FindCamera("left", scene.vehicle_body);
  scene.right_camera = contract.FindCamera("right", scene.vehicle_body);
  scene.spectator_camera = contract.FindCamera("spectator", 0);
  contract.RequireOneBody(scene.vehicle_body);
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
  return {QuaternionAt(d.xquat, body), Eigen::Map<const Vector3d>(d.xpos + 3 * body)};
}

}  // namespace turbidock::vehicle
