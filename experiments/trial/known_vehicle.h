#pragma once
// What the controller is told of the vehicle.

#include "control/vehicle_model.h"
#include "experiments/trial/scenario.h"
#include "sim/vehicle/scene.h"
#include "sim/vehicle/vehicle_params.h"

namespace turbidock::trial {

// From nominal data, with the thrusters and the camera head where the scene has them. The data need
// not be the vehicle's in the water: what that differs by, the controller does not know.
control::VehicleModel ModelOf(const vehicle::VehicleData& known, const vehicle::Scene& scene);

// The same of a scenario; reads its scene.
control::VehicleModel ModelOf(const Scenario& scenario);

}  // namespace turbidock::trial
