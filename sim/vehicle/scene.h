#pragma once
// The scene: an MJCF model and the names in it that the rest of the program relies on.
//
// Contract of models/*.xml (a missing or misplaced name is an error that says so):
//   body vehicle (free joint)
//     sites camera_head (frame H), lamp_left, lamp_right (beam along the site's x), pole_tip;
//     cameras left, right; geoms hull_* and pole, no other; actuators surge_left, surge_right,
//     sway, heave, each at a site and pushing along the site's x
//   body marker (static)
//     site marker (frame M); geoms marker_* and ball_* (one sphere a ball)
//   body station (static)
//     geoms station_* and dock_*; site dock_mouth (frame D); site dock_throat, axes as D, where the
//     straight hole begins: a box whose half sizes in y and z are the hole's
//   world
//     geoms floor, wall_*; camera spectator
// Geometry and appearance are the MJCF's, a geom's rgba being its linear albedo; masses, inertia
// and camera optics are data (VehicleParams, RigParams) that overwrite the nominal values in the
// MJCF when the scene is made. Geoms of group 3 take part in contacts only and are never drawn.

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/pose.h"

namespace turbidock::vehicle {

struct MjModelDeleter {
  void operator()(mjModel* m) const { mj_deleteModel(m); }
};
struct MjDataDeleter {
  void operator()(mjData* d) const { mj_deleteData(d); }
};
using MjModelPtr = std::unique_ptr<mjModel, MjModelDeleter>;
using MjDataPtr = std::unique_ptr<mjData, MjDataDeleter>;

// What a geom is part of, as contacts and pictures need to know it.
enum class Part { kEnvironment, kHull, kPole, kMarker, kStation, kDock };

// One ball of the marker as it stands in the scene; its colour is the water model's and vision's.
struct BallInScene {
  std::string name;      // of the geom without "ball_": "green"
  int geom = -1;         // MuJoCo geom id
  Eigen::Vector3d p_MQ;  // centre in the marker frame
  double radius_m = 0;
};

// A loaded model and the ids that others need. Constant after loading.
struct Scene {
  MjModelPtr model;
  StereoRig rig;  // as the model's cameras left and right stand
  int vehicle_body = -1, marker_body = -1, station_body = -1;
  int camera_head_site = -1, pole_tip_site = -1, marker_site = -1;
  int dock_mouth_site = -1, dock_throat_site = -1;
  std::vector<int> lamp_sites;          // left, right
  std::vector<int> thruster_actuators;  // surge_left, surge_right, sway, heave
  int left_camera = -1, right_camera = -1, spectator_camera = -1;
  std::vector<Part> geom_part;  // by geom id
  std::vector<BallInScene> balls;
  Pose X_BH;                       // camera head in the vehicle's body frame
  Pose X_WM;                       // marker in the world
  Pose X_WD;                       // dock's mouth in the world
  Eigen::Vector3d p_HQ_pole_tip;   // in H
  double dock_throat_depth_m = 0;  // from the mouth to where the straight hole begins, along D's x
  double dock_throat_half_width_m = 0;  // half the inner side of the square hole
};

// Loads an MJCF file, checks the contract and puts the rig's cameras in place (pose in H, field of
// view). Throws ConfigError with the file's name and MuJoCo's message (which has the line) or what
// is missing.
Scene LoadScene(const std::string& mjcf_path, const RigParams& rig);

// Pose of a site or body in the world, from computed positions in `d`.
Pose SitePose(const mjData& d, int site);
Pose BodyPose(const mjData& d, int body);

}  // namespace turbidock::vehicle
