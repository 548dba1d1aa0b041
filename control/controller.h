#pragma once
// What every control law offers the autopilot.

#include <cstdint>
#include <optional>

#include "control/axes.h"
#include "control/axis_volts.h"

namespace turbidock::control {

// Where the marker is in the camera head, as far as it is known.
struct Observation {
  int64_t frame = 0;             // of the image
  Axes position = Axes::Zero();  // x, y, z of M in H [m], its heading in H [rad]
  std::optional<Axes> rate;      // per second; with a pose filter only
};

// Where it shall be.
struct Reference {
  Axes position = Axes::Zero();
  Axes rate = Axes::Zero();
  Axes acceleration = Axes::Zero();
};

// A law from what is seen and what is wanted to voltages by axis. All signs are plus: a marker
// farther, further left, higher or turned counter-clockwise than wanted means positive volts.
//
// A frame is: Observe (with a usable estimate only), Demand (while there is control), Given.
class Controller {
 public:
  virtual ~Controller() = default;

  // Frames must increase and may have gaps.
  virtual void Observe(const Observation& seen) = 0;

  // The voltages that it wants for the frame observed last. At least one frame must have been.
  virtual AxisVolts Demand(const Reference& wanted) = 0;

  // What the thrusters were given at the frame, less than the demand where they saturate, zero
  // without control. Integrators and observers live on it.
  virtual void Given(int64_t frame, const AxisVolts& volts) = 0;
};

}  // namespace turbidock::control
