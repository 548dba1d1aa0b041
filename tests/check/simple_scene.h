#pragma once
// Small scenes from MJCF text, for whoever checks the plant: tests and benchmarks.

#include <string>

#include "sim/base/clock.h"
#include "sim/vehicle/scene.h"

namespace turbidock::check {

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

// Loads `world`, the inside of <worldbody>, which must hold a vehicle like the one above, and finds
// what the plant needs: geoms named pole, hull* and dock_* are these parts; a site that is missing
// stays -1. `option` holds attributes of <option>.
vehicle::Scene MakeScene(const std::string& world, const std::string& option = kWithWeight);

// The vehicle alone.
vehicle::Scene OpenWater(const std::string& option = kWithWeight);

// A clock of 10 frames a second whose tick lasts 1 / (10 n) seconds.
constexpr ClockParams TicksPerTenth(int n) {
  return {.frames_per_second = 10, .ticks_per_frame = n};
}

}  // namespace turbidock::check
