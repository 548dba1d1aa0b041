#pragma once
// Open loop: recorded or planned commands instead of a controller.

#include <string>
#include <utility>
#include <vector>

#include "control/controller.h"
#include "sim/base/fields.h"
#include "sim/base/thruster_command.h"

namespace turbidock::control {

struct PlaybackParams {
  InputFile file = {};
  double begin_s = 0;

  static void Fields(auto& self, auto&& field) {
    field("file", self.file, Finite(),
          "CSV of commands over time_s: THRUSTER_v (0 to 5), THRUSTER_pwm_us (1100 to 1900) or "
          "THRUSTER_newton for each thruster, or surge_newton, sway_newton, heave_newton, "
          "yaw_newton_m; a trial's trajectory.csv is one");
    field("begin_s", self.begin_s, Finite(),
          "time in the file of commands at which the trial begins");
  }
  // ConfigError without a file.
  void CheckInUse(const std::string& path) const;
};

// Commands over time. Each holds until the next, the last as long as the one before it; before the
// first and after the last the thrusters are off.
class Playback {
 public:
  struct Row {
    double time_s = 0;
    ThrusterCommand command;
  };

  // Times must increase.
  Playback(std::vector<Row> rows, size_t thrusters);

  const ThrusterCommand& At(double time_s) const;
  // The commands from begin to end, which is later, each with its share of that time.
  struct Part {
    double share = 1;
    const ThrusterCommand* command = nullptr;
  };
  std::vector<Part> Within(double begin_s, double end_s) const;
  double begin_s() const { return rows_.front().time_s; }
  double end_s() const { return end_s_; }

 private:
  std::vector<Row> rows_;
  ThrusterCommand off_;
  double end_s_ = 0;
};

// Asks for nothing: the controller of a vehicle whose commands are played.
class OpenLoop final : public Controller {
 public:
  void Observe(const Observation& /*seen*/) override {}
  Axes Demand(const Reference& /*wanted*/) override { return Axes::Zero(); }
  void OnCommandApplied(int64_t /*frame*/, const Axes& /*given*/) override {}
};

// A command in microseconds of pulse width as a voltage: 1100 full reverse, 1500 neutral, 1900 full
// ahead, as Blue Robotics' speed controllers take it (bluerobotics.com, "Basic ESC").
double VoltsOfPulse(double pulse_us);

}  // namespace turbidock::control
