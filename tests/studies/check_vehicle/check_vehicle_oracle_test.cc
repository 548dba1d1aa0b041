// What the check says of a vehicle against what the vehicle does in the water.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "control/thrust_allocation.h"
#include "experiments/studies/check_vehicle/check_vehicle.h"
#include "experiments/trial/world.h"
#include "sim/vehicle/plant.h"

namespace turbidock::check_vehicle {
namespace {

using control::Axes;
using control::Axis;

constexpr double kAgree = 0.01;

// The scene of a scenario, its floor far below.
vehicle::Scene WithoutFloor(const trial::Scenario& scenario) {
  vehicle::Scene scene = vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig);
  mjModel* m = scene.model.get();
  m->geom_pos[3 * mj_name2id(m, mjOBJ_GEOM, "floor") + 2] = -1e4;
  return scene;
}

class EveryVehicle : public ::testing::TestWithParam<const char*> {
 protected:
  // Deep in still water, far from the station.
  vehicle::Plant MakePlant() const {
    return vehicle::Plant(scene_, scenario_.vehicle, scenario_.clock, vehicle::Sea());
  }
  ThrusterCommand Full(Axis axis, bool ahead) const {
    const control::ForceAllocation allocation({}, trial::ModelOf(scenario_.vehicle, scene_));
    Axes demand = Axes::Zero();
    demand[axis] = (ahead ? allocation.most() : allocation.most_back())[axis];
    return allocation.Share(demand).command;
  }

  const trial::Scenario scenario_ =
      trial::LoadScenario("sea_night_active", {std::string("vehicle.model=") + GetParam()});
  const vehicle::Scene scene_ = WithoutFloor(scenario_);
  const VehicleCheck check_ = CheckVehicle(scenario_);
};

const Pose kFarBelow{Eigen::Quaterniond::Identity(), {-500, 0, -300}};

// Component of SNAME's order by control::Axis.
double Component(const Twist& V, Axis axis) { return axis == control::kYaw ? V.w.z() : V.v[axis]; }

TEST_P(EveryVehicle, GetsAsFastAsTheCheckSays) {
  for (const Axis axis : {control::kSurge, control::kSway, control::kHeave, control::kYaw})
    for (const bool ahead : {true, false}) {
      vehicle::Plant plant = MakePlant();
      plant.Reset(kFarBelow);
      const ThrusterCommand command = Full(axis, ahead);
      // Its buoyancy is held against, so that heave is the thrusters' alone.
      // The Heavy swings about its tilt at full sway, undamped in roll: the mean of half the time.
      constexpr int kTicks = 40 * 480;
      double speed = 0;
      for (int tick = 0; tick < kTicks; ++tick) {
        const Eigen::Quaterniond q = plant.truth().X_WB.q;
        Wrench hold;
        hold.f = q.conjugate() * Eigen::Vector3d(0, 0, -check_.floating.buoyancy_newton);
        plant.SetExtraWrench(hold);
        ASSERT_FALSE(plant.Step(command));
        if (tick >= kTicks / 2) speed += Component(plant.truth().V_WB_B, axis) / (kTicks / 2);
      }
      const AxisReport& report = check_.axes[axis];
      const double said = ahead ? report.speed : report.speed_back;
      EXPECT_NEAR(speed, said, kAgree * std::abs(said)) << report.axis << " " << ahead;
    }
}

TEST_P(EveryVehicle, PushesAsHardAsTheCheckSays) {
  for (const Axis axis : {control::kSurge, control::kSway, control::kHeave, control::kYaw})
    for (const bool ahead : {true, false}) {
      vehicle::Plant plant = MakePlant();
      plant.Reset(kFarBelow);
      // As long as the lag takes; the energy that the thrusters put in is force times way.
      for (int tick = 0; tick < 480; ++tick) ASSERT_FALSE(plant.Step(Full(axis, ahead)));
      Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
      const vehicle::ThrusterForces thrust = plant.truth().thrust_newton;
      const Twist V = plant.truth().V_WB_B;
      for (size_t i = 0; i < thrust.size(); ++i) {
        const vehicle::ThrusterInScene& t = scene_.thrusters[i];
        // what the inflow took at this speed is put back
        const double advance =
            std::max(0.0, std::copysign(1.0, thrust[i]) * t.axis_B.dot(V.v + V.w.cross(t.p_BT)));
        const double still =
            thrust[i] / (1 - scenario_.vehicle.thrusters.inflow_loss_s_per_m * advance);
        force += still * t.axis_B;
        moment += t.p_BT.cross(still * t.axis_B);
      }
      const double got = axis == control::kYaw ? moment.z() : force[axis];
      const AxisReport& report = check_.axes[axis];
      const double said = ahead ? report.most : report.most_back;
      EXPECT_NEAR(got, said, kAgree * std::abs(said)) << report.axis << " " << ahead;
    }
}

INSTANTIATE_TEST_SUITE_P(Bundled, EveryVehicle,
                         ::testing::Values("vehicle.xml", "bluerov2_heavy.xml"),
                         [](const auto& vehicle) {
                           const std::string name = vehicle.param;
                           return name.substr(0, name.find('.'));
                         });

}  // namespace
}  // namespace turbidock::check_vehicle
