#pragma once
// What a scenario plays back from files: commands and a measured current.

#include <string>
#include <vector>

#include "control/controller_spec.h"
#include "control/playback.h"
#include "control/vehicle_model.h"
#include "experiments/config/number_table.h"
#include "experiments/trial/scenario.h"
#include "sim/vehicle/sea.h"

namespace turbidock::trial {

// The commands of a table for a vehicle's thrusters, at the table's own times. Newtons become volts
// by the curves, demands by axis are shared out, as the vehicle knows itself. `where` names the
// table in messages: ConfigError in one line for other thrusters' names, values that look like
// another unit, a clock that runs backwards.
std::vector<control::Playback::Row> CommandsIn(const config::NumberTable& table,
                                               const std::string& where,
                                               const control::VehicleModel& vehicle);

// Those of a file, in the trial's time. ConfigError also for a gap in them, and where none falls
// into the trial.
control::Playback PlaybackOf(const control::PlaybackParams& params,
                             const control::VehicleModel& vehicle, double duration_s);
// The controller that they take the place of.
control::ControllerSpec PlaybackSpec(const control::PlaybackParams& params);

// The current of sea.current.file; nothing without one.
vehicle::CurrentSeries CurrentOf(const vehicle::SeaParams& sea);

// The scenario's water.
vehicle::Sea SeaOf(const Scenario& scenario, Rng rng);

}  // namespace turbidock::trial
