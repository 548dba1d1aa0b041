#pragma once
// Faults: what goes wrong in a trial, and when. `faults` in a scenario has a list for each sort of
// them, all empty unless the scenario says otherwise:
//
//   faults:
//     thrusters: [{thruster: sway, force_factor: 0, begin_s: 6}]
//     images: [{kind: frozen, camera: left, begin_s: 8, end_s: 9}]
//
// A fault is a value type with begin_s and end_s (sim/base/fault.h) and belongs to the module whose
// work it spoils; that module has its meaning and its arithmetic as a function of time, the world
// (world.h) asks it at every image or tick:
//
//   thrusters       sim/vehicle/thruster_fault.h  the plant, every tick: a factor on the thrust
//   lights          sim/light/light_fault.h       other lamps and balls in the same water
//   ambient_light   sim/light/light_fault.h       daylight in the same water
//   screens, fish, second_markers, mirrors, bubbles
//                   sim/view/distractors.h        balls and boxes drawn and lit beside the model's
//   misalignments   sim/camera/view_fault.h       another rig than the estimator believes in
//   dirt, blurs     sim/camera/view_fault.h       on radiance: after snow and lens
//   images          sim/camera/image_fault.h      on digitised images, on their way
//
// Control and estimator never hear of a fault; they see what it does. Time is that of the exposure,
// not of the image's arrival. What needs a whole image (dirt, blurs, images) makes both images
// whole; the others are the same in a region of the image as in all of it. A list that is empty
// costs nothing and changes no digest. Random places come from a stream of their own, "faults".
// With the true pose in the cameras' place only thrusters can fail: anything else is refused.

#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/camera/image_fault.h"
#include "sim/camera/view_fault.h"
#include "sim/light/light_fault.h"
#include "sim/vehicle/thruster_fault.h"
#include "sim/view/distractors.h"

namespace turbidock::trial {

struct Faults {
  std::vector<vehicle::ThrusterFault> thrusters;
  std::vector<camera::ImageFault> images;
  std::vector<camera::CameraMisalignment> misalignments;
  camera::PortFaults ports;  // keys dirt, blurs
  std::vector<light::LightFault> lights;
  std::vector<light::AmbientLightFault> ambient_light;
  view::DistractorFaults distractors;  // keys screens, fish, second_markers, mirrors, bubbles

  static void Fields(auto& self, auto&& field) {
    field("thrusters", self.thrusters, Finite(), "thrusters blocked, reversed or weak");
    field("images", self.images, Finite(), "images frozen, black, swapped or late");
    field("misalignments", self.misalignments, Finite(),
          "cameras turned aside, which the estimator does not know");
    field("dirt", self.ports.dirt, Finite(), "patches of dirt on the cameras' ports");
    field("blurs", self.ports.blurs, Finite(), "cameras out of focus");
    field("lights", self.lights, Finite(), "lamps and lit balls dead, dim or flickering");
    field("ambient_light", self.ambient_light, Finite(), "daylight that comes in addition");
    view::DistractorFaults::Fields(self.distractors, field);
  }

  // Whether anything that cameras see is wrong at any time.
  bool seen() const {
    return !images.empty() || !misalignments.empty() || ports.any() || !lights.empty() ||
           !ambient_light.empty() || distractors.any();
  }
};

}  // namespace turbidock::trial
