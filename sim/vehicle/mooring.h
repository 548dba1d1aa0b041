#pragma once
// How the station moves: swung as asked, drawn along by the water on a mooring, turned by the
// current. It is far heavier than the vehicle, so it moves as if the vehicle were not there.

#include <Eigen/Core>

#include "sim/base/fields.h"
#include "sim/base/random.h"
#include "sim/vehicle/sea.h"

namespace turbidock::vehicle {

struct MooringParams {
  double swing_x_m = 0, swing_y_m = 0;
  double swing_period_s = 8;  // guess: a sea's
  double natural_period_s = 0;
  double damping_ratio = 0.2;  // guess
  double weathervane_arm_m = 0;

  static void Fields(auto& self, auto&& field) {
    field("swing_x_m", self.swing_x_m, InRange(0, 5),
          "amplitude of the station's sinusoidal motion along the x of the world's frame W, its "
          "phase drawn from the seed");
    field("swing_y_m", self.swing_y_m, InRange(0, 5),
          "amplitude of the station's sinusoidal motion along the y of the world's frame W, its "
          "phase drawn from the seed");
    field("swing_period_s", self.swing_period_s, InRange(0.5, 600),
          "period of the station's sinusoidal motions along x and y");
    field("natural_period_s", self.natural_period_s, InRange(0, 600),
          "natural period of the station on its mooring, drawn along by current and waves; 0: the "
          "station stays");
    field(
        "damping_ratio", self.damping_ratio, InRange(0.01, 5),
        "ratio of the station's damping on its mooring, by the water's drag, to critical damping");
    field("weathervane_arm_m", self.weathervane_arm_m, InRange(0, 100),
          "length of the arm on which the current turns the station about its swivel, until the "
          "vehicle comes in against the current; 0: the station does not turn");
  }

  void Check(const std::string& path) const {
    // faster ones need steps finer than the physics
    constexpr double kFastest_s = 0.5;
    if (natural_period_s > 0 && natural_period_s < kFastest_s)
      throw ConfigError(JoinKey(path, "natural_period_s"),
                        FormatNumber(natural_period_s) + " must be 0 or in [0.5, 600]");
  }

  bool drawn() const { return natural_period_s > 0; }
  bool turns() const { return weathervane_arm_m > 0; }
};

// A value: copies run on independently and equally.
//
// The water draws a neutrally buoyant body on a mooring along, with its own mass and added mass
// against the same of the water that it displaces (Morison's inertia, with linear drag):
//
//   x'' = u' + 2 zeta w (u - x') - w^2 x
//
// u the water's velocity at the station, w = 2 pi / natural_period_s: a soft mooring goes with the
// waves, a stiff one stands, and a current u shifts it by 2 zeta u / w. A vane at the angle psi
// that a flow u trails at length L turns as
//
//   psi' = |u| / L sin(psi_u - psi),
//
// which waves, to and fro, move little.
class Mooring {
 public:
  Mooring() = default;  // stands still
  // `heading_rad`: of insertion (D's x) about W's z, undisplaced.
  Mooring(const MooringParams& params, double heading_rad, Rng rng);

  // Begins at time 0 in a sea in which it has swung for long, at p_WK undisplaced.
  void Reset(const Sea& sea, const Eigen::Vector3d& p_WK);
  // Moves on over the tick that begins at time_s.
  void Step(const Sea& sea, double time_s, double dt_s);

  // Of the station from where the MJCF has it: x and y along W's axes [m], about W's z [rad].
  const Eigen::Vector3d& displacement() const { return displacement_; }
  const MooringParams& params() const { return params_; }

 private:
  void Displace(double time_s);

  MooringParams params_;
  double heading_rad_ = 0;
  Eigen::Array2d phase_rad_ = Eigen::Array2d::Zero();
  Eigen::Vector3d p_WK_ = Eigen::Vector3d::Zero();
  Eigen::Vector2d drawn_m_ = Eigen::Vector2d::Zero(), drawn_mps_ = Eigen::Vector2d::Zero();
  double yaw_rad_ = 0;
  Eigen::Vector3d displacement_ = Eigen::Vector3d::Zero();
};

}  // namespace turbidock::vehicle
