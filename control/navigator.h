#pragma once
// From the readings of the vehicle's navigation to where it is in every frame.

#include <array>
#include <cstdint>
#include <optional>

#include "control/axes.h"
#include "sim/base/axes_pose.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"
#include "sim/base/navigation_reading.h"

namespace turbidock::control {

struct NavigatorParams {
  double acceleration_mps2 = 0.05;   // guess: what waves and thrusters do to it
  double acceleration_rad_s2 = 0.1;  // guess
  double max_age_s = 10;             // guess: a few of an acoustic system's drop-outs

  static void Fields(auto& self, auto&& field) {
    field(
        "acceleration_mps2", self.acceleration_mps2, Above(0),
        "navigation filter: standard deviation of the vehicle's acceleration between two readings");
    field(
        "acceleration_rad_s2", self.acceleration_rad_s2, Above(0),
        "navigation filter: standard deviation of the heading's acceleration between two readings");
    field("max_age_s", self.max_age_s, InRange(0.1, 600),
          "navigation filter: time without a fix after which the vehicle does not steer by "
          "navigation");
  }
};

// Where the camera head H is in the marker's frame M by navigation, and how that changes.
struct Navigated {
  AxesPose pose_MH;
  Axes rate_M = Axes::Zero();  // of its position in M [m/s] and of its heading [rad/s]
};

// The gains of the steady filter of a thing that keeps its speed: alpha of the innovation goes to
// the position, beta / gap to the rate (Kalata 1984; Bar-Shalom, Li and Kirubarajan 2001, section
// 6.5). `noise` is of a reading, `acceleration` is constant over a gap and independent of the last.
struct AlphaBeta {
  double alpha = 1, beta = 0;
};
AlphaBeta SteadyGains(double noise, double acceleration, double gap_s);

// Each axis by itself, from one reading to the next however far apart they are. While the marker is
// seen, what navigation is off by is learnt; where the marker is lost, the vehicle so still knows
// where it was.
class Navigator {
 public:
  Navigator(const NavigatorParams& params, const ClockParams& clock);  // checked: ConfigError

  // Frames must increase.
  void Update(int64_t frame, const std::optional<NavigationReading>& reading);
  // What the cameras say of the frame updated last.
  void Correct(const AxesPose& marker_in_head);
  // What was learnt is of no use any more: the marker is not where it should be.
  void DropCorrection() { correction_ = {}; }

  // Nothing before the first fix, and when the last is too old.
  std::optional<Navigated> pose() const;

 private:
  struct Track {
    double position = 0, rate = 0;
    std::optional<int64_t> frame;  // of the last reading
  };
  void Read(Axis axis, double value, double noise);

  NavigatorParams params_;
  ClockParams clock_;
  std::optional<int64_t> frame_;
  std::array<Track, kAxisCount> tracks_;  // of H in M, in the order of Axis
  AxesPose correction_;                   // to be added
};

}  // namespace turbidock::control
