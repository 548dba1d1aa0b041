#pragma once
// What a person would say of an image: can the balls be seen, is it white?

#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/base/pose.h"
#include "vision/marker_model.h"

namespace turbidock::recognition {

struct Look {
  // By how many 8-bit steps a ball stands out of what is around it, in its own colour: the channel
  // of its hue over the mean of the other two, its disc against a ring of 1.3 to 1.7 radii; of the
  // ball where it is least.
  double ball_dn = 0;
  // Of the mean colour of the image: its largest channel, and (max - min) / max.
  double brightness_dn = 0, saturation = 0;
};

// Of one camera's image with the marker at X_HM. The balls must be in front of the camera.
Look LookOf(const Image3u8& image, const MountedCamera& camera, const vision::MarkerParams& marker,
            const Pose& X_HM);

}  // namespace turbidock::recognition
