#pragma once
// What can be set about the cameras and all that is before them.

#include "sim/camera/lens.h"
#include "sim/camera/sensor_params.h"
#include "sim/light/marine_snow.h"
#include "sim/light/optics_params.h"

namespace turbidock::camera {

// Everything between what a camera has before it and its 8-bit images, as data.
struct CameraParams {
  light::OpticsParams optics;
  light::SnowParams snow;
  LensParams lens;
  SensorParams sensor;
};

}  // namespace turbidock::camera
