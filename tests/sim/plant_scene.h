#pragma once
// Small scenes for tests and benchmarks of the plant, from MJCF text.

#include <mujoco/mujoco.h>

#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "sim/base/check.h"
#include "sim/plant.h"

namespace turbidock::testing {

// A boxy vehicle in open water 5 m below the surface, its thrusters as in the vehicle's own MJCF.
inline constexpr const char* kVehicleBody = R"(
  <body name="vehicle" pos="0 0 -5">
    <freejoint/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <geom name="hull" type="box" size="0.19 0.14 0.155"/>
    <geom name="pole" type="capsule" size="0.0175" fromto="0.1 0 -0.11 0.4825 0 -0.11"/>
    <site name="pole_tip" pos="0.5 0 -0.11"/>
    <site name="surge_left" pos="-0.13 0.10 0"/>
    <site name="surge_right" pos="-0.13 -0.10 0"/>
    <site name="sway" pos="0 0 0" euler="0 0 90"/>
    <site name="heave" pos="0 0 0" euler="0 -90 0"/>
  </body>)";

inline constexpr const char* kWithWeight = "gravity='0 0 -9.81'";
inline constexpr const char* kWeightless = "gravity='0 0 0'";

// Loads `world` (the inside of <worldbody>) and finds the names in it; what is missing stays -1.
// `option` holds attributes of <option>.
inline sim::Scene MakeScene(const std::string& world, const std::string& option = kWithWeight) {
  const std::string xml = "<mujoco><option " + option + "/><worldbody>" + world +
                          R"(</worldbody><actuator>
    <motor name="surge_left" site="surge_left"/><motor name="surge_right" site="surge_right"/>
    <motor name="sway" site="sway"/><motor name="heave" site="heave"/></actuator></mujoco>)";
  const auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
  mj_makeEmptyFileVFS(vfs.get(), "scene.xml", static_cast<int>(xml.size()));
  std::memcpy(vfs->filedata[0], xml.data(), xml.size());
  char error[500] = "";
  sim::Scene scene;
  scene.model.reset(mj_loadXML("scene.xml", vfs.get(), error, sizeof error));
  mj_deleteVFS(vfs.get());
  TD_CHECK(scene.model, error);

  const mjModel* m = scene.model.get();
  scene.vehicle_body = mj_name2id(m, mjOBJ_BODY, "vehicle");
  scene.pole_tip_site = mj_name2id(m, mjOBJ_SITE, "pole_tip");
  scene.dock_mouth_site = mj_name2id(m, mjOBJ_SITE, "dock_mouth");
  for (const char* name : {"surge_left", "surge_right", "sway", "heave"})
    scene.thruster_actuators.push_back(mj_name2id(m, mjOBJ_ACTUATOR, name));
  for (int g = 0; g < m->ngeom; ++g) {
    const char* text = mj_id2name(m, mjOBJ_GEOM, g);
    const std::string_view name = text ? text : "";
    scene.geom_part.push_back(name == "pole"              ? sim::Part::kPole
                              : name.starts_with("dock_") ? sim::Part::kDock
                              : name.starts_with("hull")  ? sim::Part::kHull
                                                          : sim::Part::kEnvironment);
  }
  return scene;
}

// The vehicle alone.
inline sim::Scene OpenWater(const std::string& option = kWithWeight) {
  return MakeScene(kVehicleBody, option);
}

// A clock of 10 frames a second whose tick lasts 1 / (10 n) seconds.
inline ClockParams TicksPerTenth(int n) { return {.frames_per_second = 10, .ticks_per_frame = n}; }

}  // namespace turbidock::testing
