#pragma once
// Smaller or larger images from the same cameras: --resolution 320x240.

#include <string>
#include <vector>

namespace turbidock::trial {

// "320x240" as assignments that give both cameras this size. The field of view across stays, so
// focal length and principal point follow. ConfigError for anything else.
std::vector<std::string> ResolutionAssignments(const std::string& text);

}  // namespace turbidock::trial
