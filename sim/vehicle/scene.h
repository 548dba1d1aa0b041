#pragma once
// The scene: an MJCF model and the names in it that the rest of the program relies on.
//
// What it must name is in ModelNames(); a missing or misplaced name is an error that says so.
// Geometry and appearance are the MJCF's, a geom's rgba being its linear albedo; masses, inertia
// and camera optics are data (VehicleParams, RigParams) that overwrite the nominal values in the
// MJCF when the scene is made. Geoms of group 3 take part in contacts only and are never drawn.

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/pose.h"
#include "sim/vehicle/model_files.h"

namespace turbidock::vehicle {

// A name that the program relies on.
struct ModelName {
  const char* of;    // the part that has it: "vehicle", "marker", "station", "world"
  const char* kind;  // "body", "site", "camera", "geom", "motor"
  const char* name;  // or how it begins: "hull_*"; "*": any
  const char* meaning;
};
std::span<const ModelName> ModelNames();

struct MjDataDeleter {
  void operator()(mjData* d) const { mj_deleteData(d); }
};
using MjDataPtr = std::unique_ptr<mjData, MjDataDeleter>;

// MuJoCo's group of geoms that are collided with and never drawn.
inline constexpr int kContactsOnlyGroup = 3;

// What a geom is part of, as contacts and pictures need to know it.
enum class Part { kEnvironment, kHull, kPole, kMarker, kStation, kDock };

// One ball of the marker as it stands in the scene; its colour is the water model's and vision's.
struct BallInScene {
  std::string name;      // of the geom without "ball_": "green"
  int geom = -1;         // MuJoCo geom id
  Eigen::Vector3d p_MQ;  // centre in the marker frame
  double radius_m = 0;
};

// A thruster as it stands in the vehicle.
struct ThrusterInScene {
  std::string name;  // of the motor
  int actuator = -1;
  Eigen::Vector3d p_BT = Eigen::Vector3d::Zero();  // where it pushes, in the vehicle's body frame
  Eigen::Vector3d axis_B = Eigen::Vector3d::UnitX();  // where to
};
// The thruster of a motor at a site.
ThrusterInScene ThrusterAt(const mjModel& m, int actuator);
std::vector<std::string> NamesOf(const std::vector<ThrusterInScene>& thrusters);

// The body that holds station and marker, where it can move: its joints, -1 for those it lacks.
struct MooredBody {
  int body = -1;                             // -1: nothing moves
  std::array<int, 3> joints = {-1, -1, -1};  // mooring_x, mooring_y, mooring_yaw; -1: has none
};

// A loaded model and the ids that others need. Constant after loading.
struct Scene {
  MjModelPtr model;
  StereoRig rig;  // as the model's cameras left and right stand
  int vehicle_body = -1, marker_body = -1, station_body = -1;
  int camera_head_site = -1, pole_tip_site = -1, marker_site = -1;
  int dock_mouth_site = -1, dock_throat_site = -1;
  std::vector<int> lamp_sites;             // left, right
  std::vector<ThrusterInScene> thrusters;  // in the order of their motors
  int left_camera = -1, right_camera = -1, spectator_camera = -1;
  std::vector<Part> geom_part;  // by geom id
  std::vector<BallInScene> balls;
  Pose X_BH;  // camera head in the vehicle's body frame
  MooredBody moored_body;
  Pose X_WM;                       // marker in the world, undisplaced
  Pose X_WD;                       // dock's mouth in the world, undisplaced
  Eigen::Vector3d p_HQ_pole_tip;   // in H
  double dock_throat_depth_m = 0;  // from the mouth to where the straight hole begins, along D's x
  double dock_throat_half_width_m = 0;  // half the inner side of the square hole
};

// Loads a scene, checks the contract and puts the rig's cameras in place (pose in H, field of
// view). Throws ConfigError with the file's name and MuJoCo's message (which has the line) or what
// is missing.
Scene LoadScene(const SceneFiles& files, const RigParams& rig);

// A model by itself, which need not be a scene: MJCF, or URDF as far as MuJoCo reads it.
// ConfigError as above.
MjModelPtr LoadModel(const std::string& path);
// The names of a vehicle that it lacks.
std::vector<ModelName> LackingVehicleNames(const mjModel& model);

// Pose of a site or body in the world, from computed positions in `d`.
Pose SitePose(const mjData& d, int site);
Pose BodyPose(const mjData& d, int body);

}  // namespace turbidock::vehicle
