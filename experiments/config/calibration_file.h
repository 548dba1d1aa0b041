#pragma once
// Stereo calibrations as other programs write them.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "experiments/config/yaml_node.h"
#include "sim/base/stereo.h"
#include "vision/undistort.h"

namespace turbidock::config {

struct ImageSize {
  int width_px = 0, height_px = 0;
};

struct CalibratedCamera {
  YamlNode at;                    // its camera matrix, for messages
  Eigen::Matrix3d K;              // that matrix
  vision::LensDistortion lens;    // in the same numbers
  std::optional<ImageSize> size;  // of its images, where the files say it
};

struct Calibration {
  std::string files;  // their names, for messages
  Stereo<CalibratedCamera> cameras;
  // A point of the left camera's frame in the right one's: p_R = R_RL p_L + p_RL.
  Eigen::Matrix3d R_RL;
  Eigen::Vector3d p_RL;
};

// Reads the calibration that the files together hold, told by what is in them:
// OpenCV's matrices as YAML, XML or JSON, two files of ROS's camera_info, the left camera's first,
// or Kalibr's camchain. Nothing for files of our own; ConfigError for what is missing or unknown.
std::optional<Calibration> ReadCalibration(const std::vector<std::string>& files);

}  // namespace turbidock::config
