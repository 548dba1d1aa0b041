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

// Reads our own rig file (keys of RigParams), or OpenCV's stereo calibration: files of
// cv::FileStorage that together hold M1, D1, M2, D2, R and T (also K1/K2, cameraMatrix1/2,
// distCoeffs1/2), as its sample stereo_calib writes them; T in metres. The size of the images is
// read from image_width and image_height or imageSize; where a calibration does not say it, the
// images' own is taken. The head frame H then sits midway between the optical centres, y along the
// baseline to the left, x along the mean of both optical axes. ConfigError for what is missing or
// cannot be, a baseline of zero for instance.
RigFromFile LoadRig(const std::vector<std::string>& files, int image_width_px, int image_height_px);

}  // namespace turbidock::config
