#pragma once
// What the pole and the dock did to each other in a trial, gathered frame by frame.

#include <optional>

#include "experiments/trial/trial_log.h"
#include "sim/base/fields.h"

namespace turbidock::trial {

// When the pole counts as jammed. Guesses: with the published servo, a pole that sticks to the rim
// of the mouth was seen to be held there by 1.3 to 1.9 N for seconds, within 1 mm.
struct JamParams {
  double force_newton = 1;
  double time_s = 1;
  double progress_m = 0.003;

  static void Fields(auto& self, auto&& field) {
    field("force_newton", self.force_newton, Above(0), "the pole is held by more than this");
    field("time_s", self.time_s, Above(0), "for at least this long");
    field("progress_m", self.progress_m, Above(0), "while its depth changes by less than this");
  }
};

struct Contact {
  double time_s = 0;
  double force_newton = 0;

  bool operator==(const Contact&) const = default;

  static void Fields(auto& self, auto&& field) {
    field("time_s", self.time_s, Finite(), "the first one's time");
    field("force_newton", self.force_newton, Finite(), "its force");
  }
};

class DockContact {
 public:
  explicit DockContact(const JamParams& jam) : jam_(jam) {}

  void Update(const FrameRecord& frame);

  // Nothing when it has not happened. Each is the first time only.
  std::optional<Contact> first_contact() const { return first_contact_; }
  std::optional<double> insertion_time_s() const { return insertion_time_s_; }
  std::optional<double> jam_time_s() const { return jam_time_s_; }  // when it was established
  double force_max_newton() const { return force_max_newton_; }

 private:
  JamParams jam_;
  std::optional<Contact> first_contact_;
  std::optional<double> insertion_time_s_, jam_time_s_;
  double force_max_newton_ = 0;
  // Since when the pole has been held where it is.
  std::optional<double> held_since_s_;
  double held_depth_m_ = 0;
};

}  // namespace turbidock::trial
