#pragma once
// A linear-quadratic regulator with its Kalman filter, for one axis or for two that turn with each
// other.

#include <Eigen/Core>
#include <vector>

#include "control/axis_model.h"

namespace turbidock::control {

// An axis with what is asked of it.
struct LqgAxis {
  AxisModel model;
  // Costs: this error, this speed and this deviation from the force that stands still weigh the
  // same.
  double error = 1, speed = 1, effort = 1;
  double noise = 1;             // standard deviation of the measured position
  double least = -1, most = 1;  // of the demand
};

// Positions are the vehicle's, less the marker's. Where there are two axes the second turns the
// vehicle and moves the first's position by a lever: y' = v + lever * rate.
//
//   force = -K (x - wanted) - (current + wave) + what the wanted motion takes
//
// K is the gain of the regulator whose effort counts from the force that stands still in current
// and waves; it acts on thrust and waves too, and so makes up for the thrusters' lag. Gains are
// designed for a row of levers and interpolated.
class LqgLoop {
 public:
  LqgLoop(const std::vector<LqgAxis>& axes, const std::vector<double>& levers, double dt_s);

  // At rest at a position. What is known of the current is kept.
  void Start(const Eigen::VectorXd& position);
  // One step on under the forces that were asked for.
  void Predict(const Eigen::VectorXd& force, double lever);
  // The axis' position in the state.
  double position(Eigen::Index axis) const { return state_[kAxisStates * axis + kPosition]; }
  // The force by which current and what else is steady push the axis.
  double current(Eigen::Index axis) const { return state_[kAxisStates * axis + kCurrent]; }
  void SetCurrent(Eigen::Index axis, double force) {
    state_[kAxisStates * axis + kCurrent] = force;
  }
  // Measured less predicted position of the most surprising axis, in standard deviations.
  double Surprise(const Eigen::VectorXd& position, double lever);
  void Correct(const Eigen::VectorXd& position, double lever);

  // The demand that answers the state that will be: StartAhead, then Ahead for each step of the
  // latency.
  void StartAhead() { ahead_ = state_; }
  void Ahead(const Eigen::VectorXd& force, double lever);
  const Eigen::VectorXd& Demand(const Eigen::VectorXd& position, const Eigen::VectorXd& speed,
                                const Eigen::VectorXd& acceleration, double lever);

  // States of the axes one after the other.
  const Eigen::VectorXd& state() const { return state_; }

 private:
  // What is designed for a lever.
  struct Gains {
    double lever = 0;
    Eigen::MatrixXd A, B, regulator, kalman;
    Eigen::VectorXd innovation_std;
  };
  // A lever between two of the row: low + share * (high - low).
  struct Between {
    const Gains *low, *high;
    double share;
  };

  Gains Design(double lever, double dt_s) const;
  Between At(double lever) const;
  void Step(const Eigen::VectorXd& force, double lever, Eigen::VectorXd* state);

  std::vector<LqgAxis> axes_;
  std::vector<Gains> gains_;  // by increasing lever
  Eigen::VectorXd state_, ahead_;
  Eigen::VectorXd low_, high_, innovation_, force_;  // scratch, so that no frame allocates
};

}  // namespace turbidock::control
