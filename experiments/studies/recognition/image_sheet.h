#pragma once
// What the cameras see in the recognition experiment, after the published Figs. 11 and 13.

#include <string>
#include <vector>

#include "experiments/studies/recognition/recognition.h"

namespace turbidock::recognition {

// Left and right images of a cell's last frame with the estimated marker as dotted circles,
// distance down, milk across, as a PNG. One marker's results; at most `columns` steps of milk.
// Contrast is stretched. ConfigError when the path cannot be written.
void WriteImageSheet(const std::string& path, const Recognition& recognition,
                     const std::vector<CellResult>& results, int columns);

}  // namespace turbidock::recognition
