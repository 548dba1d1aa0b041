#pragma once
// A URDF as a vehicle of this program: one body of all its links, as they stand with every joint at
// 0, in the frame of the root link. Each link becomes a site of its name; on a joint that turns, x
// lies along the joint's axis, in a link named *thruster* with a cylinder along the cylinder.

#include <string>
#include <vector>

#include "sim/vehicle/vehicle_params.h"

namespace turbidock::check_vehicle {

struct UrdfVehicle {
  std::string mjcf;                    // text of the file
  vehicle::RigidBodyParams body;       // of all links, about their common centre of mass
  int links = 0;                       // with a mass
  std::vector<std::string> thrusters;  // links of such a name, else those that turn for ever
  std::vector<std::string> held;       // joints that could move: "arm (revolute)"
  std::vector<std::string> not_drawn;  // meshes that MuJoCo does not read: "hull.dae of base_link"
};

// By what it holds or is called: a URDF, or the xacro of one.
bool IsUrdf(const std::string& file);

// Meshes are named as they are found from `folder`, where the MJCF will stand. ConfigError with
// file and line for what is no URDF, lacks a mass, a link or a mesh. Nothing is lost but a picture
// where MuJoCo does not read the mesh of a <visual>; one of a <collision> it must.
UrdfVehicle ReadUrdf(const std::string& file, const std::string& folder);

}  // namespace turbidock::check_vehicle
