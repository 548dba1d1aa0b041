#pragma once
// What every controller offers the autopilot.

#include <cstdint>
#include <optional>

#include "control/axes.h"
#include "sim/base/attitude.h"
#include "sim/base/navigation_reading.h"
#include "sim/base/thruster_command.h"

namespace turbidock::control {

// Where the marker is in the camera head, as far as it is known, and what the other sensors say.
struct Observation {
  int64_t frame = 0;             // of the image
  Axes position = Axes::Zero();  // x, y, z of M in H [m], its heading in H [rad]
  std::optional<Axes> rate;      // per second; with a pose filter only
  // Of the position, as its estimator claims; nothing: it claims nothing.
  std::optional<Axes> variance = {};
  double fitness = 0;  // F of the estimate
  // Read when the image arrived; navigation where the trial has it.
  Attitude attitude = {};
  std::optional<NavigationReading> navigation = {};
};

// Where it shall be.
struct Reference {
  Axes position = Axes::Zero();
  Axes rate = Axes::Zero();
  Axes acceleration = Axes::Zero();
};

// A controller from what is seen and what is wanted to a demand by axis: forces [N] ahead, left and
// up and a moment [N m] counter-clockwise seen from above, in the vehicle's body frame. (The
// published controller's are volts, which only the published vehicle understands.) All signs are
// plus: a marker farther, further left, higher or turned counter-clockwise than wanted means a
// positive demand.
//
// A frame is: Observe (with a usable estimate only, else Predict where it is asked), Demand (while
// there is control), OnCommandApplied.
class Controller {
 public:
  virtual ~Controller() = default;

  // Frames must increase and may have gaps.
  virtual void Observe(const Observation& seen) = 0;

  // What it wants for the frame observed last. At least one frame must have been.
  virtual Axes Demand(const Reference& wanted) = 0;

  // Its own command of each thruster for that, where no allocation shall share it out; Demand then
  // gave the forces and the moment that come of it.
  virtual const ThrusterCommand* Command() const { return nullptr; }

  // Where its model says that the marker is at a frame without a usable estimate, given what the
  // thrusters did; for every such frame in order. Nothing from a controller without a model.
  virtual std::optional<Axes> Predict(int64_t /*frame*/) { return std::nullopt; }

  // What the thrusters were given at the frame, less than the demand where they saturate, zero
  // without control. Integrators and observers live on it.
  virtual void OnCommandApplied(int64_t frame, const Axes& given) = 0;
};

}  // namespace turbidock::control
