#pragma once
// Stereo rigs from disk.

#include <string>
#include <vector>

#include "sim/base/camera.h"
#include "vision/undistort.h"

namespace turbidock::config {

struct RigFromFile {
  StereoRig rig;
  Stereo<vision::LensDistortion> distortion;
};

// Reads our own rig file (all keys of RigParams) or a stereo calibration (calibration_file.h),
// lengths in metres. Where a calibration does not say the size of its images, it is that of the
// images given, which the principal point must then agree with. The head frame H sits midway
// between the optical centres, x along the mean of both optical axes, y along the baseline to the
// left; where the baseline is nearer to vertical, y is the left image's left. ConfigError for what
// is missing or cannot be, a baseline of zero for instance.
RigFromFile LoadRig(const std::vector<std::string>& files, int image_width_px, int image_height_px);

}  // namespace turbidock::config
