#include "experiments/trial/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/trial/recorded.h"
#include "experiments/trial/scene_marker.h"
#include "sim/base/units.h"
#include "sim/light/own_shadow.h"
#include "sim/light/surfaces.h"
#include "sim/vehicle/sea.h"

namespace turbidock::trial {
namespace {

constexpr int kSpectatorWidth_px = 320, kSpectatorHeight_px = 240;

// Of the x axis about the vertical.
double HeadingOf(const Pose& X_WD) {
  const Eigen::Vector3d x_W = X_WD.q * Eigen::Vector3d::UnitX();
  return std::atan2(x_W.y(), x_W.x());
}

// A lamp moved so far ahead would stand behind the marker, or in the station, of a docked vehicle.
void CheckLamps(const Scenario& scenario, const vehicle::Scene& scene) {
  const double docked_x_m = scenario.procedure.docked_x_m;
  for (const Pose& X_HE_of_scene : light::LampPoses(scene)) {
    const double ahead_m = light::PlaceLamp(X_HE_of_scene, scenario.light.lamps).p.x();
    if (scenario.light.lamps.enabled && ahead_m >= docked_x_m)
      throw ConfigError("lights.lamps.shift_m",
                        fmt::format("puts a lamp {:.3g} m ahead of the cameras, behind the marker "
                                    "of a docked vehicle (procedure.docked_x_m: {})",
                                    ahead_m, FormatNumber(docked_x_m)));
  }
}

// The camera head in the marker's frame.
Pose DrawStart(const Scenario& scenario) {
  Rng rng = SeedTree(static_cast<uint64_t>(scenario.seed)).Stream("start");
  const StartParams& s = scenario.start;
  const double distance_m = rng.Uniform(s.distance_min_m, s.distance_max_m);
  const double y_m = rng.Uniform(-s.lateral_m, s.lateral_m);
  const double z_m = rng.Uniform(-s.vertical_m, s.vertical_m);
  const double yaw_rad = rng.Uniform(-s.heading_rad, s.heading_rad);
  const double pitch_rad = rng.Uniform(-s.pitch_rad, s.pitch_rad);
  const double roll_rad = rng.Uniform(-s.roll_rad, s.roll_rad);
  return {FromYawPitchRoll(yaw_rad, pitch_rad, roll_rad), {-distance_m, y_m, z_m}};
}

vehicle::Plant PlantOf(const Scenario& scenario, const vehicle::Scene& scene) {
  const SeedTree seeds(static_cast<uint64_t>(scenario.seed));
  return {scene,
          scenario.vehicle,
          scenario.clock,
          SeaOf(scenario, seeds.Stream("sea")),
          {scenario.mooring, HeadingOf(scene.X_WD), seeds.Stream("mooring")}};
}

}  // namespace

Start StartOf(const Scenario& scenario, const vehicle::Scene& scene, const Pose& X_WM) {
  if (scenario.start.placed()) {
    const Pose X_WB = scenario.start.placed_X_WB();
    return {.X_MH = X_WM.Inverse() * X_WB.Canonical() * scene.X_BH, .X_WB = X_WB};
  }
  const Pose X_MH = DrawStart(scenario);
  return {.X_MH = X_MH, .X_WB = X_WM * X_MH * scene.X_BH.Inverse()};
}

Pose StartPose(const Scenario& scenario) {
  if (!scenario.start.placed()) return DrawStart(scenario);
  const vehicle::Scene scene = vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig);
  return StartOf(scenario, scene, PlantOf(scenario, scene).X_WM()).X_MH;
}

World::Cameras::Cameras(const Scenario& scenario, const vehicle::Scene& scene,
                        const std::vector<view::Distractor>& distractors, const SeedTree& seeds)
    : context(view::MakeGlContext(scenario.renderer, &remark)),
      renderer(*context, scene, distractors),
      camera(scenario.cameras(), scenario.rig.MakeRig(),
             light::SurfaceTable::FromScene(scene, distractors), light::LampPoses(scene),
             scenario.image_clock().frame_s(), seeds),
      then(mj_makeData(scene.model.get())),
      images(scenario.faults.images) {}

World::World(const Scenario& scenario, const TrialOptions& options)
    : seeds_(static_cast<uint64_t>(scenario.seed)),
      clock_(scenario.clock),
      scene_(vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig)),
      faults_(scenario.faults),
      distractors_(
          view::DistractorsOf(faults_.distractors, scene_, seeds_.Stream("faults").NextU64())),
      optics_(scenario.light),
      rig_(scene_.rig),
      plant_(PlantOf(scenario, scene_)),
      attitude_sensor_(scenario.attitude_sensor, seeds_.Stream("attitude")),
      navigation_sensor_(scenario.navigation, seeds_.Stream("navigation")) {
  CheckMarker(scenario, scene_);
  CheckLamps(scenario, scene_);
  if (scenario.pose_source == PoseSource::kCameras || options.whole_images || options.spectator)
    cameras_.emplace(scenario, scene_, distractors_, seeds_);
  if (options.spectator)
    spectator_.emplace(*cameras_->context, scene_, kSpectatorWidth_px, kSpectatorHeight_px);
  plant_.SetThrusterFaults(faults_.thrusters, "faults");
  PlaceAtStart(scenario);
}

void World::PlaceVehicle(const Pose& X_MH) {
  const Pose X_WH = plant_.X_WM() * X_MH;
  plant_.Reset(X_WH * scene_.X_BH.Inverse());
}

void World::PlaceAtStart(const Scenario& scenario) {
  plant_.Reset(StartOf(scenario, scene_, plant_.X_WM()).X_WB);
  plant_.SetVelocity(scenario.start.V_WB_B());
}

void World::Capture(Snapshot* snapshot) const {
  const mjData& data = plant_.data();
  snapshot->time_s = plant_.time_s();
  snapshot->qpos.assign(data.qpos, data.qpos + scene_.model->nq);
  snapshot->true_X_HM = true_X_HM();
  snapshot->water_drift_m = plant_.water_drift_m();
}

void World::RenderImages(const Snapshot& snapshot, int64_t number,
                         const std::optional<StereoRegion>& region, StageTimer* timer,
                         StereoImage* out) {
  mjData* then = cameras_->then.get();
  std::copy(snapshot.qpos.begin(), snapshot.qpos.end(), then->qpos);
  mj_kinematics(scene_.model.get(), then);
  mj_camlight(scene_.model.get(), then);
  if (faults_.seen()) Disturb(snapshot.time_s);
  const StereoRegion needed =
      cameras_->images.on() ? cameras_->camera.whole() : region.value_or(cameras_->camera.whole());
  cameras_->renderer.Render(*then, cameras_->camera.Seen(needed, number), &cameras_->rendered,
                            timer);
  cameras_->rendered.drift_m = snapshot.water_drift_m;
  cameras_->camera.Expose(cameras_->rendered, needed, number, out, timer);
  cameras_->images.Apply(snapshot.time_s, out);
}

light::Water World::WaterAt(const light::OpticsParams& sound, double time_s) const {
  const light::LightsNow lights = light::LightsAt(sound.ball_lights, faults_.lights, time_s);
  light::OpticsParams optics = sound;
  optics.ball_lights = lights.balls;
  return {optics, scene_.rig, light::SurfaceTable::FromScene(scene_, distractors_),
          light::LampPoses(scene_), lights.lamp_factors};
}

// Lights, rig, ports and distractors as they are at an instant.
void World::Disturb(double time_s) {
  Disturbance now;
  for (const light::LightFault& fault : faults_.lights)
    now.light_factors.push_back(light::FactorAt(fault, time_s));
  for (const camera::CameraMisalignment& fault : faults_.misalignments)
    now.misaligned.push_back(fault.Holds(time_s));
  if (now != disturbance_) {
    disturbance_ = now;
    scene_.rig = camera::Misaligned(rig_, camera::HoldingAt(faults_.misalignments, time_s));
    cameras_->camera.SetWater(WaterAt(optics_, time_s));
  }
  if (!faults_.ambient_light.empty())
    cameras_->camera.SetDaylight(light::DaylightAt(faults_.ambient_light, time_s));
  cameras_->camera.SetPortFaults({camera::HoldingAt(faults_.ports.dirt, time_s),
                                  camera::HoldingAt(faults_.ports.blurs, time_s)});
  std::vector<view::PlacedDistractor> placed;
  for (const view::Distractor& distractor : distractors_) placed.push_back(distractor.At(time_s));
  cameras_->renderer.Place(std::move(placed));
}

void World::SetOptics(const Scenario& scenario) {
  CheckLamps(scenario, scene_);
  if (cameras_) cameras_->camera.SetWater(WaterAt(scenario.light, plant_.time_s()));
  optics_ = scenario.light;
  disturbance_ = {};  // lights and rig anew at the next image
}

// The scene's own view of the dock, from as much farther back as the vehicle needs to be in it, and
// through the walls that are then in the way.
const Image3u8* World::DrawSpectator() {
  if (!spectator_) return nullptr;
  const mjModel& model = *scene_.model;
  mjData* now = cameras_->then.get();
  mju_copy(now->qpos, plant_.data().qpos, model.nq);
  mj_kinematics(&model, now);
  mj_camlight(&model, now);
  const int camera = scene_.spectator_camera;
  const Eigen::Map<const Eigen::Vector3d> p_WC(now->cam_xpos + 3 * camera);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R_WC(now->cam_xmat +
                                                                            9 * camera);
  // MuJoCo's cameras look along -z
  const Eigen::Vector3d p_CB = R_WC.transpose() * (plant_.truth().X_WB.p - p_WC);
  // Half the published hull's diagonal is 0.28 m; the rest is water around it.
  constexpr double kVehicle_m = 0.35, kAspect = double{kSpectatorWidth_px} / kSpectatorHeight_px;
  const double slope = std::tan(units::RadFromDeg(model.cam_fovy[camera]) / 2);
  const double needed_m = std::max((std::abs(p_CB.x()) + kVehicle_m) / (slope * kAspect),
                                   (std::abs(p_CB.y()) + kVehicle_m) / slope);
  const double back_m = std::max(0.0, needed_m + p_CB.z());
  spectator_->Render(*now, camera, &spectator_image_, back_m,
                     std::min(back_m, back_m - p_CB.z() - kVehicle_m));
  return &spectator_image_;
}

std::optional<std::string> World::AdvanceBy(
    const CommandAt& command_at, vehicle::ContactReport* contacts,
    const std::function<void(const ThrusterCommand&)>& observe) {
  *contacts = {};
  std::optional<std::string> fault;
  for (int i = 0; i < clock_.ticks_per_frame; ++i) {
    const ThrusterCommand& command = command_at(plant_.time_s());
    if (observe) observe(command);
    if ((fault = plant_.Step(command))) break;
    const vehicle::ContactReport now = plant_.contacts();
    contacts->dock_force_newton = std::max(contacts->dock_force_newton, now.dock_force_newton);
    if (now.collision_force_newton > contacts->collision_force_newton) {
      contacts->collision_force_newton = now.collision_force_newton;
      contacts->collision = now.collision;
    }
  }
  return fault;
}

control::VehicleModel ModelOf(const vehicle::VehicleData& known, const vehicle::Scene& scene) {
  using vehicle::Dof;
  const auto axes = [](const vehicle::Vector6d& all) -> control::Axes {
    return {all[static_cast<int>(Dof::kSurge)], all[static_cast<int>(Dof::kSway)],
            all[static_cast<int>(Dof::kHeave)], all[static_cast<int>(Dof::kYaw)]};
  };
  const vehicle::HydroModel hydro(known.LoadedHydrodynamics());
  const vehicle::Matrix6d mass =
      vehicle::RigidBodyInertia(known.LoadedRigidBody()) + hydro.added_mass;
  control::VehicleModel model;
  model.inertia = axes(mass.diagonal());
  model.roll_pitch_inertia = {mass.diagonal()[static_cast<int>(Dof::kRoll)],
                              mass.diagonal()[static_cast<int>(Dof::kPitch)]};
  model.linear_damping = axes(hydro.linear_damping.diagonal());
  model.quadratic_damping = axes(hydro.quadratic_damping.diagonal());
  model.thruster_lag_s = 0;
  model.head_ahead_m = scene.X_BH.p.x();
  const std::vector<std::string> names = NamesOf(scene.thrusters);
  const auto kinds = known.thrusters.Of(names, "control.known_vehicle.thrusters");
  const PerThruster effectiveness = known.thrusters.Effectiveness(names.size());
  for (size_t i = 0; i < names.size(); ++i) {
    model.thrusters.push_back({.name = names[i],
                               .p_BT = scene.thrusters[i].p_BT,
                               .axis_B = scene.thrusters[i].axis_B,
                               .curve = kinds[i],
                               .effectiveness = effectiveness[i]});
    // The laws' model has no dead time: as much lag stands for it.
    model.thruster_lag_s = std::max(model.thruster_lag_s, kinds[i].lag_s + kinds[i].dead_time_s);
  }
  return model;
}

void CheckFiles(const Scenario& scenario) {
  const vehicle::Scene scene = vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig);
  CurrentOf(scenario.sea);
  if (const auto commands = scenario.plugins.Spec().commands)
    commands(ModelOf(scenario.known_vehicle, scene), scenario.duration_s);
}

control::VehicleModel ModelOf(const Scenario& scenario) {
  return ModelOf(scenario.known_vehicle, vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig));
}

}  // namespace turbidock::trial
