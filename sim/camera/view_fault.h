#pragma once
// What goes wrong before the sensor: dirt on a camera's port, a lens out of focus, a camera that
// was turned aside. Light is linear there, so they act on radiance.

#include <Eigen/Core>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/fault.h"
#include "sim/light/radiance.h"

namespace turbidock::camera {

struct BlurFault : FaultSpan {
  FaultyCamera camera = FaultyCamera::kBoth;
  double sigma_px = 4;

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("camera", self.camera, Finite(), "camera that is out of focus");
    field("sigma_px", self.sigma_px, InRange(0.1, 50),
          "width (sigma) of the Gaussian blur of a camera that is out of focus");
  }
};

struct DirtFault : FaultSpan {
  FaultyCamera camera = FaultyCamera::kBoth;
  Eigen::Vector2d center{0.5, 0.5};
  double radius = 0.15;
  double transmission = 0.05;

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("camera", self.camera, Finite(), "camera whose port is dirty");
    field("center", self.center, InRange(0, 1),
          "centre of the patch of dirt: share of the image's width from its left, share of its "
          "height from its top");
    field("radius", self.radius, InRange(0.01, 2),
          "radius of the patch of dirt, as a share of the image's width; from half of it on the "
          "dirt fades");
    field("transmission", self.transmission, InRange(0, 1),
          "share of light that the dirt on a camera's port lets through");
  }
};

struct CameraMisalignment : FaultSpan {
  FaultyCamera camera = FaultyCamera::kLeft;
  Eigen::Vector3d yaw_pitch_roll_rad{0.0349, 0, 0};  // 2 degrees aside

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("camera", self.camera, Finite(), "camera that no longer looks straight ahead");
    field("yaw_pitch_roll_rad", self.yaw_pitch_roll_rad, InRange(-1, 1),
          "angles by which a camera is turned in the head, about its optical centre: yaw to the "
          "left, pitch down, roll clockwise");
  }
};

// The faults of this kind that there are at one instant.
template <class Fault>
std::vector<Fault> HoldingAt(const std::vector<Fault>& faults, double time_s) {
  std::vector<Fault> holding;
  for (const Fault& fault : faults)
    if (fault.Holds(time_s)) holding.push_back(fault);
  return holding;
}

// The rig with its cameras as they are turned by these.
StereoRig Misaligned(const StereoRig& rig, const std::vector<CameraMisalignment>& faults);

// Dirt, then blur. Beyond an image's edge it is as at the edge.
struct PortFaults {
  std::vector<DirtFault> dirt;
  std::vector<BlurFault> blurs;

  bool any() const { return !dirt.empty() || !blurs.empty(); }
  void Spoil(light::RadianceStereo* images) const;
};

}  // namespace turbidock::camera
