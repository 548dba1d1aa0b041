#pragma once
// The vehicle's navigation: where it believes to be, with the errors that such systems have.

#include <Eigen/Core>
#include <optional>

#include "sim/base/fields.h"
#include "sim/base/navigation_reading.h"
#include "sim/base/pose.h"
#include "sim/base/random.h"

namespace turbidock::vehicle {

// Complete settings of all keys, as data to begin with.
enum class NavigationPreset {
  kDvl,            // a Doppler log on the sea bed, with a compass and a pressure sensor
  kUsbl,           // acoustic fixes from a transceiver, likewise
  kDeadReckoning,  // compass and the speed that the thrusters should give
  kPilot,          // nothing but a person who looks
  kNever,          // none at all
};
constexpr auto Names(NavigationPreset) {
  using enum NavigationPreset;
  return EnumList<NavigationPreset>({{kDvl, "dvl"},
                                     {kUsbl, "usbl"},
                                     {kDeadReckoning, "dead_reckoning"},
                                     {kPilot, "pilot"},
                                     {kNever, "never"}});
}

// The struct's defaults are those of `dvl`. Sources: "A50" is Water Linked's documentation of the
// DVL A50 (long-term accuracy of the speed 1.01 %; 10 Hz at 0.3 to 3 m above the bed; every 10 s
// some readings are lost to a check of the bottom lock), "SeaTrac" Blueprint Subsea's X100 series
// (positions in decimetres), "LinkQuest" that maker's tank test of a USBL (0.1 degrees, 0.02 m);
// the others are guesses, those of headings for a calibrated magnetic compass of a small vehicle,
// "several degrees" in the literature.
struct NavigationParams {
  NavigationPreset preset = NavigationPreset::kDvl;
  double position_bias_std_m = 0.1;  // guess: of the fix that it began with, and of the chart
  double position_drift_std_mps = 0;
  double position_walk_m = 0.002;       // guess: 5 mm/s of noise in each of 10 speeds a second
  double travel_error_std = 0.0101;     // A50
  double position_noise_std_m = 0.005;  // guess
  double rate_hz = 10;                  // A50
  double dropout_share = 0.03;          // A50: some readings every 10 s
  double dropout_s = 0.3;               // guess
  double depth_bias_std_m = 0.03;       // guess: tide and mooring against the chart
  double depth_noise_std_m = 0.005;     // guess
  double heading_bias_std_rad = 0.05;   // guess: 3 degrees
  double heading_walk_rad = 0.0003;     // guess: 0.1 degrees in half a minute
  double heading_noise_std_rad = 0.005;

  static NavigationParams Of(NavigationPreset preset);
  static constexpr std::array kPresets = {"preset"};
  void Given(const std::string& key) {
    if (key == "preset") *this = Of(preset);
  }

  static void Fields(auto& self, auto&& field) {
    field("preset", self.preset, Range{},
          "sets all other keys of navigation but its attitude_sensor: dvl, usbl, dead_reckoning, "
          "pilot, or never (it reports nothing)");
    field("position_bias_std_m", self.position_bias_std_m, InRange(0, 10),
          "navigation: standard deviation of a trial's constant error of position, along each "
          "horizontal axis");
    field("position_drift_std_mps", self.position_drift_std_mps, InRange(0, 1),
          "navigation: standard deviation of a trial's constant drift of position, along each "
          "horizontal axis, by a current that it does not know");
    field("position_walk_m", self.position_walk_m, InRange(0, 1),
          "navigation: standard deviation that the random walk of position reaches in a second, "
          "along each horizontal axis");
    field("travel_error_std", self.travel_error_std, InRange(0, 1),
          "navigation: standard deviation of a trial's error of the way travelled, along and "
          "across it, as a share of the way");
    field("position_noise_std_m", self.position_noise_std_m, InRange(0.001, 10),
          "navigation: standard deviation of the error of each fix, along each horizontal axis");
    field("rate_hz", self.rate_hz, InRange(0.01, 1000),
          "navigation: fixes a second; no more than there are images");
    field("dropout_share", self.dropout_share, InRange(0, 0.99),
          "navigation: share of the time without fixes");
    field("dropout_s", self.dropout_s, InRange(0.01, 3600),
          "navigation: mean time of a drop-out of fixes");
    field("depth_bias_std_m", self.depth_bias_std_m, InRange(0, 10),
          "navigation: standard deviation of a trial's constant error of the depth");
    field("depth_noise_std_m", self.depth_noise_std_m, InRange(0.001, 10),
          "navigation: standard deviation of the error of each reading of the depth");
    field("heading_bias_std_rad", self.heading_bias_std_rad, InRange(0, 1),
          "navigation: standard deviation of a trial's constant error of the heading");
    field("heading_walk_rad", self.heading_walk_rad, InRange(0, 1),
          "navigation: standard deviation that the random walk of the heading reaches in a second");
    field("heading_noise_std_rad", self.heading_noise_std_rad, InRange(0.0001, 1),
          "navigation: standard deviation of the error of each reading of the heading");
  }
};

// Errors are in the chart's axes, those of the marker's frame M, but for that of the way travelled.
class NavigationSensor {
 public:
  NavigationSensor(const NavigationParams& params, const Rng& rng);

  // A reading; each draws as many numbers. Times [s] must increase. Nothing from `never`.
  std::optional<NavigationReading> Read(double time_s, const Pose& true_X_MH);

 private:
  Eigen::Vector2d TwoNormals();
  void Move(double time_s, const Eigen::Vector2d& true_xy_m);

  NavigationParams params_;
  Rng rng_;
  Eigen::Vector2d bias_m_, drift_mps_, travel_error_;  // of this trial
  double depth_bias_m_, heading_error_rad_;
  Eigen::Vector2d walk_m_ = Eigen::Vector2d::Zero(), lag_m_ = Eigen::Vector2d::Zero();
  std::optional<double> first_s_, last_s_;
  Eigen::Vector2d last_xy_m_ = Eigen::Vector2d::Zero();
  bool dropped_out_;
  double next_fix_s_ = 0;
};

}  // namespace turbidock::vehicle
