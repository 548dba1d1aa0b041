#pragma once
// The least model that satisfies the contract, and what is said of others.

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "sim/base/check.h"
#include "sim/vehicle/scene.h"

namespace turbidock::vehicle {

// The least that satisfies the contract.
inline constexpr const char* kSmallest = R"(<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <camera name="spectator" pos="0 0 1"/>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="vehicle" pos="-2 0 1">
      <freejoint/>
      <geom name="hull_box" type="box" size="0.1 0.1 0.1"/>
      <geom name="pole" type="capsule" size="0.01" fromto="0 0 0 0.3 0 0"/>
      <site name="camera_head" pos="0.1 0.02 0.03"/>
      <site name="lamp_left"/>
      <site name="lamp_right"/>
      <site name="pole_tip" pos="0.31 0 0"/>
      <site name="left" pos="0 0.1 0"/>
      <site name="up" euler="0 -1.5707963267948966 0"/>
      <camera name="left"/>
      <camera name="right"/>
    </body>
    <body name="marker" pos="0.5 0 1" euler="0 0 0.5">
      <site name="marker" pos="0.1 0 0"/>
      <geom name="ball_pink" type="sphere" size="0.03" pos="0.1 0.2 0"/>
    </body>
    <body name="station" pos="0.5 0 1">
      <geom name="dock_block" type="box" size="0.1 0.1 0.1"/>
      <site name="dock_mouth" pos="0 0 0.5"/>
      <site name="dock_throat" pos="0.2 0 0.5" type="box" size="0.01 0.05 0.05"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="port" site="left" gear="1 0 0 0 0 0"/>
    <motor name="lift" site="up" gear="1 0 0 0 0 0"/>
  </actuator>
</mujoco>
)";

inline std::string WriteModel(const std::string& text) {
  const std::string path = ::testing::TempDir() + "scene_unit_test.xml";
  std::ofstream(path) << text;
  return path;
}

inline std::string WithChange(const std::string& from, const std::string& to) {
  std::string text = kSmallest;
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

inline std::string ErrorOf(const std::string& path, const RigParams& rig = {}) {
  try {
    LoadScene({path}, rig);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace turbidock::vehicle
