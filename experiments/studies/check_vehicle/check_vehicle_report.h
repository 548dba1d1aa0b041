#pragma once
// A vehicle's check in words, as a figure, and the names that a model must have.

#include <string>

#include "experiments/studies/check_vehicle/check_vehicle.h"

namespace turbidock::check_vehicle {

std::string CheckText(const VehicleCheck& check);

// The thrusters from above and from the side, their forces and the speeds they reach, and how the
// vehicle swings. ConfigError for another kind of file than .png, .svg, .pdf.
void WriteCheckFigure(const std::string& path, const VehicleCheck& check);

// vehicle::ModelNames as a table: Markdown, as models/README.md shows it, or aligned.
std::string NamesTable(bool markdown);

}  // namespace turbidock::check_vehicle
