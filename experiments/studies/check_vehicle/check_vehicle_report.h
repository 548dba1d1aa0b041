#pragma once
// A vehicle's check as a report, and the names that a model must have.

#include "experiments/report/report.h"
#include "experiments/studies/check_vehicle/check_vehicle.h"

namespace turbidock::check_vehicle {

// What is wrong, how it floats, what it sees; its thrusters, their forces and the speeds they
// reach.
report::Report ReportOf(const VehicleCheck& check);

// vehicle::ModelNames as a table. `quoted`: names as code in Markdown.
report::Table NamesTable(bool quoted);

}  // namespace turbidock::check_vehicle
