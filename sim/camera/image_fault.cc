#include "sim/camera/image_fault.h"

#include <algorithm>
#include <utility>

namespace turbidock::camera {

FaultyImages::FaultyImages(std::vector<ImageFault> faults) : faults_(std::move(faults)) {
  for (const ImageFault& fault : faults_)
    if (fault.kind == ImageFaultKind::kLate)
      longest_ = std::max(longest_, static_cast<size_t>(fault.late_images));
}

void FaultyImages::Apply(double time_s, StereoImage* images) {
  if (!on()) return;
  if (longest_ > 0) {
    exposed_.push_back(*images);
    if (exposed_.size() > longest_ + 1) exposed_.pop_front();
  }
  for (const ImageFault& fault : faults_) {
    if (!fault.Holds(time_s)) continue;
    if (fault.kind == ImageFaultKind::kSwapped) {
      std::swap(images->left, images->right);
      continue;
    }
    for (const Side side : kSides) {
      if (!Has(fault.camera, side)) continue;
      Image3u8& image = (*images)[side];
      if (fault.kind == ImageFaultKind::kBlack) {
        std::fill_n(image.data(), 3 * image.pixels(), uint8_t{0});
      } else if (fault.kind == ImageFaultKind::kLate) {
        const size_t late = static_cast<size_t>(fault.late_images);
        image = exposed_[exposed_.size() - 1 - std::min(late, exposed_.size() - 1)][side];
      } else if (!arrived_[side].empty()) {
        image = arrived_[side];
      }
    }
  }
  arrived_ = *images;
}

}  // namespace turbidock::camera
