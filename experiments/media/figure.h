#pragma once
// Figures (report/plot.h) as files: PNG, SVG or PDF, drawn by gnuplot.

#include <string>

#include "experiments/report/plot.h"
#include "experiments/report/report.h"

namespace turbidock::media {

// Throws SimulatorFault when this machine cannot draw figures.
void RequireFigures();

// ConfigError for a path whose end names no format of figures: ".png", ".svg", ".pdf".
void RequireFigurePath(const std::string& path);

// ConfigError when the path cannot be written or ends otherwise; SimulatorFault when gnuplot is
// missing or cannot draw the figure (a logarithmic axis from below 0).
void WriteFigure(const std::string& path, const report::Figure& figure);

// All plots of a report, in their order; a row a section where all sections have as many, one
// column where those of a section are stacked.
report::Figure FigureOf(const report::Report& report);

}  // namespace turbidock::media
