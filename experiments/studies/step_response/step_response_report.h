#pragma once
// Step responses for people and programs.

#include <string>
#include <vector>

#include "experiments/studies/step_response/step_response.h"
#include "experiments/trial/scenario.h"

namespace turbidock::step_response {

// A row an axis, in mm and degrees.
std::string StepTable(const std::vector<AxisResponse>& responses);

// Everything but the time series; SI units. Keys are those of the structs.
std::string StepJson(const trial::Scenario& scenario, const std::vector<AxisResponse>& responses);

// The series: a row a frame, axis by axis.
std::string StepCsv(const std::vector<AxisResponse>& responses);

// A column an axis: answer to the step, to the force, and the loop's gain and phase.
void WriteStepFigure(const std::string& path, const std::string& title,
                     const std::vector<AxisResponse>& responses);

}  // namespace turbidock::step_response
