#pragma once

#include <filesystem>

#include "vision/marker_model.h"

namespace turbidock::dataset {

inline constexpr int kMarkerId = 1;  // BOP's and COCO's number of the only object

// Writes the marker as BOP has its models: the mesh as ASCII .ply, and models_info.json with its
// size and its balls. All in mm, in the marker's frame M.
void WriteModel(const vision::MarkerParams& marker, const std::filesystem::path& folder);

}  // namespace turbidock::dataset
