#pragma once
// What goes wrong with the images between a camera and whoever reads them, after the sensor.

#include <cstddef>
#include <deque>
#include <vector>

#include "sim/base/fault.h"
#include "sim/base/image.h"

namespace turbidock::camera {

enum class ImageFaultKind {
  kFrozen,   // the last image before it began, again and again
  kBlack,    // nothing but zeros
  kSwapped,  // left and right have changed places
  kLate,     // an older image
};
constexpr auto Names(ImageFaultKind) {
  using enum ImageFaultKind;
  return EnumList<ImageFaultKind>(
      {{kFrozen, "frozen"}, {kBlack, "black"}, {kSwapped, "swapped"}, {kLate, "late"}});
}

struct ImageFault : FaultSpan {
  ImageFaultKind kind = ImageFaultKind::kFrozen;
  FaultyCamera camera = FaultyCamera::kBoth;
  int late_images = 3;

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("kind", self.kind, Finite(),
          "fault of the images: frozen (the last image again and again), black, swapped (left and "
          "right exchanged) or late (older images)");
    field("camera", self.camera, Finite(),
          "camera whose images are at fault; always both if kind is swapped");
    field("late_images", self.late_images, InRange(1, 100),
          "number of images by which late images are late");
  }
};

// The images as they arrive. It keeps copies of them, so they must be whole.
class FaultyImages {
 public:
  explicit FaultyImages(std::vector<ImageFault> faults);

  bool on() const { return !faults_.empty(); }
  // Makes of the images that were exposed at `time_s` those that arrive. To be called with every
  // pair, in order. Several faults apply in their order; what is late or frozen is as the camera
  // gave it, or as it arrived last.
  void Apply(double time_s, StereoImage* images);

 private:
  std::vector<ImageFault> faults_;
  size_t longest_ = 0;                      // images to keep of the past
  std::deque<Stereo<Image3u8>> exposed_{};  // the latest last
  Stereo<Image3u8> arrived_;                // the latest before the images now at hand
};

}  // namespace turbidock::camera
