#pragma once
// A report for people: in a terminal, or as Markdown. Plots are left out.

#include <string>

#include "experiments/report/report.h"

namespace turbidock::report {

std::string Text(const Report& report);
std::string Markdown(const Report& report);

}  // namespace turbidock::report
