#pragma once
// Figures of the recognition experiment, after the published ones.

#include <string>
#include <vector>

#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"

namespace turbidock::recognition {

// Mean F over milk, a curve a distance with its deviation, a panel a marker; the rows of
// `published` as points. ConfigError when the path cannot be written, SimulatorFault when gnuplot
// fails; so all.
void WriteFitnessFigure(const std::string& path, const std::vector<CellResult>& results,
                        const std::vector<TableRow>& published);

// Areas I, II and III over milk and distance, a panel a marker; below a distance's row the
// published areas, where there are any.
void WriteAreaFigure(const std::string& path, const std::vector<CellResult>& results,
                     const std::vector<TableRow>& published);

// F over time with its mean for the first cell of each Area at each distance that occurs (after the
// published Figs. 10 and 12).
void WriteTimeFigure(const std::string& path, const std::vector<CellResult>& results,
                     double frames_per_second);

// Left and right images with the estimated marker as dotted circles, distance down, milk across
// (after the published Figs. 11 and 13). One marker's results; at most `columns` steps of milk.
void WriteContactSheet(const std::string& path, const Recognition& recognition,
                       const std::vector<CellResult>& results, int columns);

}  // namespace turbidock::recognition
