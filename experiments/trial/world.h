#pragma once
// One side of a trial's loop: the vehicle in the water, and the cameras that look out of it.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "control/vehicle_model.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/base/image.h"
#include "sim/base/random.h"
#include "sim/base/stage_timer.h"
#include "sim/base/thruster_command.h"
#include "sim/camera/stereo_camera.h"
#include "sim/vehicle/attitude_sensor.h"
#include "sim/vehicle/navigation_sensor.h"
#include "sim/vehicle/plant.h"
#include "sim/vehicle/scene.h"
#include "sim/view/gl_context.h"
#include "sim/view/stereo_renderer.h"

namespace turbidock::trial {

// An instant at which the cameras were exposed.
struct Snapshot {
  double time_s = 0;
  std::vector<mjtNum> qpos;  // where everything was
  Pose true_X_HM;
  Eigen::Vector3d water_drift_m = Eigen::Vector3d::Zero();
};

// The vehicle in the water, and its cameras where something looks through them.
class World {
 public:
  // Draws the outside view, too, if the options want it. ConfigError when the scenario cannot run,
  // SimulatorFault when this machine cannot draw.
  World(const Scenario& scenario, const TrialOptions& options);

  // Puts the vehicle at rest with its camera head there in the marker's frame; time begins anew.
  void PlaceVehicle(const Pose& X_MH);
  // Puts it where the scenario has it begin.
  void PlaceAtStart(const Scenario& scenario);

  void Capture(Snapshot* snapshot) const;
  // The images of a snapshot, or a region of them. A timer gets the stages up to kSensor.
  void RenderImages(const Snapshot& snapshot, int64_t number,
                    const std::optional<StereoRegion>& region, StageTimer* timer, StereoImage* out);
  const Image3u8* DrawSpectator();  // null without one

  // The scenario's water and lights from the next image on, another sea from the next tick on.
  // Fields are checked before (CheckFields). ConfigError for lights that a trial could not begin
  // with; nothing has changed then.
  void SetOptics(const Scenario& scenario);
  void SetSea(const vehicle::SeaParams& sea) { plant_.SetSea(sea); }

  // A steady wrench on the vehicle, until another.
  void ApplyWrench(const Wrench& F_B_B) { plant_.SetExtraWrench(F_B_B); }
  // What the thrusters are commanded from an instant on.
  using CommandAt = std::function<const ThrusterCommand&(double time_s)>;
  // Lets a frame's time pass under the commands of its ticks; `observe` sees each, at its
  // beginning. Contacts are the strongest of its ticks. Returns why the physics failed, if it did.
  std::optional<std::string> AdvanceBy(
      const CommandAt& command_at, vehicle::ContactReport* contacts,
      const std::function<void(const ThrusterCommand&)>& observe = {});
  std::optional<std::string> Advance(const ThrusterCommand& command,
                                     vehicle::ContactReport* contacts) {
    return AdvanceBy([&command](double) -> const ThrusterCommand& { return command; }, contacts);
  }

  // What the attitude sensor says now; each reading has noise of its own.
  Attitude ReadAttitude() {
    const vehicle::VehicleTruth truth = plant_.truth();
    return attitude_sensor_.Read(truth.X_WB, truth.V_WB_B);
  }
  // What its navigation says now; likewise. The chart has the station where it was moored.
  std::optional<NavigationReading> ReadNavigation() {
    const Pose X_WH = plant_.truth().X_WB * scene_.X_BH;
    return navigation_sensor_.Read(plant_.time_s(), scene_.X_WM.Inverse() * X_WH);
  }
  Pose true_X_HM() const { return (plant_.truth().X_WB * scene_.X_BH).Inverse() * plant_.X_WM(); }
  const vehicle::Plant& plant() const { return plant_; }
  const vehicle::Scene& scene() const { return scene_; }
  const SeedTree& seeds() const { return seeds_; }
  // What draws, and why it is not the kind asked for; empty where nothing draws or it is.
  std::string renderer() const { return cameras_ ? cameras_->context->description() : ""; }
  std::string remark() const { return cameras_ ? cameras_->remark : ""; }

 private:
  // From the state of the world to images.
  struct Cameras {
    Cameras(const Scenario& scenario, const vehicle::Scene& scene,
            const std::vector<view::Distractor>& distractors, const SeedTree& seeds);

    std::string remark;  // why the context is not the kind asked for, or empty
    std::unique_ptr<view::GlContext> context;
    view::StereoRenderer renderer;
    camera::StereoCamera camera;
    vehicle::MjDataPtr then;  // everything where it was at a snapshot
    view::RenderedStereo rendered;
    camera::FaultyImages images;
  };
  // What is wrong with lights and rig at an instant.
  struct Disturbance {
    std::vector<double> light_factors;
    std::vector<bool> misaligned;
    bool operator==(const Disturbance&) const = default;
  };
  void Disturb(double time_s);
  light::Water WaterAt(const light::OpticsParams& sound, double time_s) const;

  SeedTree seeds_;
  ClockParams clock_;
  vehicle::Scene scene_;  // its rig as the cameras now stand
  Faults faults_;
  std::vector<view::Distractor> distractors_;
  light::OpticsParams optics_;  // without faults
  StereoRig rig_;               // likewise
  Disturbance disturbance_;
  vehicle::Plant plant_;
  vehicle::AttitudeSensor attitude_sensor_;
  vehicle::NavigationSensor navigation_sensor_;
  std::optional<Cameras> cameras_;
  std::optional<view::SpectatorRenderer> spectator_;
  Image3u8 spectator_image_;
};

// Where a trial begins, drawn from the scenario's seed or placed (start.position_m): the camera
// head in the marker's frame, the vehicle in the world. X_WM: of the marker then.
struct Start {
  Pose X_MH, X_WB;
};
Start StartOf(const Scenario& scenario, const vehicle::Scene& scene, const Pose& X_WM);

// The camera head in the marker's frame when the scenario's trial begins. Reads its scene where the
// start is placed.
Pose StartPose(const Scenario& scenario);

// What the controller is told of the vehicle.
// From nominal data, with the thrusters and the camera head where the scene has them. The data need
// not be the vehicle's in the water: what that differs by, the controller does not know.
control::VehicleModel ModelOf(const vehicle::VehicleData& known, const vehicle::Scene& scene);

// The same of a scenario; reads its scene.
control::VehicleModel ModelOf(const Scenario& scenario);

// ConfigError for what is wrong in the files that a scenario's trial reads: what its start would
// say.
void CheckFiles(const Scenario& scenario);

}  // namespace turbidock::trial
