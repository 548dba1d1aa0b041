#include "experiments/trial/dock_contact.h"

#include <algorithm>
#include <cmath>

namespace turbidock::trial {

void DockContact::Update(const FrameRecord& frame) {
  if (!first_contact_ && frame.dock_force_newton > 0)
    first_contact_ = Contact{frame.time_s, frame.dock_force_newton};
  if (!insertion_time_s_ && frame.inserted) insertion_time_s_ = frame.time_s;
  force_max_newton_ = std::max(force_max_newton_, frame.dock_force_newton);

  if (frame.inserted || frame.dock_force_newton <= jam_.force_newton) {
    held_since_s_.reset();
    return;
  }
  // Progress begins the wait anew, from where it has got to.
  if (!held_since_s_ || std::abs(frame.insertion_depth_m - held_depth_m_) >= jam_.progress_m) {
    held_since_s_ = frame.time_s;
    held_depth_m_ = frame.insertion_depth_m;
  }
  // Frame times are sums of fractions: forgive their rounding.
  if (!jam_time_s_ && frame.time_s - *held_since_s_ >= jam_.time_s - 1e-9)
    jam_time_s_ = frame.time_s;
}

}  // namespace turbidock::trial
