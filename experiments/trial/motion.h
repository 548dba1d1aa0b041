#pragma once
// The vehicle's motion at the rate of the physics, as a table that playback and identification
// read: columns as of experiments/python/turbidock/logs/motion.py.

#include <string>
#include <vector>

#include "experiments/config/number_table.h"
#include "experiments/trial/trial.h"

namespace turbidock::trial {

// Of the scenario's vehicle; reads its scene.
std::vector<std::string> ThrusterNamesOf(const Scenario& scenario);

// Collects TrialOptions::on_tick. The columns: the vehicle's pose and velocities, what its attitude
// sensor said last, the water's velocity, each thruster's command and its thrust, the demand by
// axis.
class MotionLog {
 public:
  explicit MotionLog(const std::vector<std::string>& thrusters);

  void Add(const MotionTick& tick);
  const config::NumberTable& table() const { return table_; }

 private:
  std::vector<std::string> thrusters_;
  config::NumberTable table_;
};

}  // namespace turbidock::trial
