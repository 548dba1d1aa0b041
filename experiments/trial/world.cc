#include "experiments/trial/world.h"

#include <algorithm>

#include "experiments/trial/trial.h"
#include "sim/camera/image_sensor.h"
#include "sim/light/surfaces.h"
#include "sim/light/water.h"
#include "sim/vehicle/sea.h"

namespace turbidock::trial {
namespace {

constexpr int kSpectatorWidth_px = 320, kSpectatorHeight_px = 240;

}  // namespace

World::Cameras::Cameras(const Scenario& scenario, const vehicle::Scene& scene,
                        const SeedTree& seeds)
    : context(view::MakeGlContext(scenario.renderer, &remark)),
      renderer(*context, scene),
      camera(light::Water(scenario.optics, scenario.rig.MakeRig(),
                          light::SurfaceTable::FromScene(scene), light::LampPoses(scene)),
             camera::ImageSensor(scenario.sensor, seeds.Stream("camera.left").NextU64(),
                                 seeds.Stream("camera.right").NextU64(), scenario.rig.width_px),
             camera::AutoExposure(scenario.sensor, scenario.image_clock().frame_s()),
             light::MarineSnow(scenario.snow, scenario.rig.MakeRig(),
                               scenario.image_clock().frame_s(), seeds.Stream("snow").NextU64()),
             camera::StereoLens(scenario.lens, scenario.rig.MakeRig())),
      exposed(mj_makeData(scene.model.get())) {}

World::World(const Scenario& scenario, bool spectator, StageTimer* timer)
    : seeds_(static_cast<uint64_t>(scenario.seed)),
      clock_(scenario.clock),
      scene_(vehicle::LoadScene(SceneFile(scenario), scenario.rig)),
      plant_(scene_, scenario.vehicle, clock_, vehicle::Sea(scenario.sea, seeds_.Stream("sea"))),
      timer_(timer) {
  CheckMarker(scenario, scene_);
  if (scenario.pose_source == PoseSource::kCameras) cameras_.emplace(scenario, scene_, seeds_);
  if (spectator) {
    if (!cameras_)
      throw ConfigError("pose_source",
                        "true_pose draws nothing; a video needs pose_source = cameras");
    spectator_.emplace(*cameras_->context, scene_, kSpectatorWidth_px, kSpectatorHeight_px);
  }
  const Pose X_WH = scene_.X_WM * DrawStart(scenario);
  plant_.Reset(X_WH * scene_.X_BH.Inverse());
}

void World::Expose(Exposure* exposure) const {
  const mjData& data = plant_.data();
  exposure->tick = plant_.tick();
  exposure->qpos.assign(data.qpos, data.qpos + scene_.model->nq);
  exposure->true_X_HM = true_X_HM();
}

void World::Develop(const Exposure& exposure, int64_t number,
                    const std::optional<StereoRegion>& region, StereoImage* out) {
  mjData* exposed = cameras_->exposed.get();
  std::copy(exposure.qpos.begin(), exposure.qpos.end(), exposed->qpos);
  mj_kinematics(scene_.model.get(), exposed);
  mj_camlight(scene_.model.get(), exposed);
  const StereoRegion needed = region.value_or(cameras_->camera.whole());
  cameras_->renderer.Render(*exposed, exposure.tick, cameras_->camera.Seen(needed),
                            &cameras_->rendered, timer_);
  cameras_->camera.Expose(cameras_->rendered, needed, number, out, timer_);
}

const Image3u8* World::DrawSpectator() {
  if (!spectator_) return nullptr;
  spectator_->Render(plant_.data(), scene_.spectator_camera, &spectator_image_);
  return &spectator_image_;
}

std::optional<std::string> World::Advance(const ThrusterCommand& command,
                                          vehicle::ContactReport* contacts) {
  *contacts = {};
  std::optional<std::string> fault;
  for (int i = 0; i < clock_.ticks_per_frame; ++i) {
    if ((fault = plant_.Step(command))) break;
    const vehicle::ContactReport now = plant_.contacts();
    contacts->dock_force_newton = std::max(contacts->dock_force_newton, now.dock_force_newton);
    if (now.collision_force_newton > contacts->collision_force_newton) {
      contacts->collision_force_newton = now.collision_force_newton;
      contacts->collision = now.collision;
    }
  }
  Lap(timer_, LoopStage::kPhysics);
  return fault;
}

Eyes::Eyes(const Scenario& scenario, bool whole_images, StageTimer* timer, World* world)
    : world_(*world),
      timer_(timer),
      schedule_(scenario.camera_period_frames, scenario.camera_delay_frames),
      whole_images_(whole_images),
      drop_probability_(scenario.camera_drop_probability),
      drops_(world->seeds().Stream("camera.drops")),
      exposures_(static_cast<size_t>(schedule_.under_way()) + 1) {
  const SeedTree& seeds = world_.seeds();
  if (scenario.pose_source == PoseSource::kCameras) {
    estimator_.emplace(scenario.estimator, scenario.marker, scenario.hue, scenario.rig.MakeRig(),
                       seeds.Stream("vision.rm_ga"));
    estimator_->set_timer(timer);
  } else {
    true_pose_.emplace(scenario.true_pose, scenario.marker, scenario.rig.MakeRig(),
                       scenario.image_clock().frame_s(), seeds.Stream("true_pose"));
  }
  for (int64_t frame = schedule_.first_frame(); frame < 0; ++frame) Expose(frame);
}

bool Eyes::Update(int64_t frame) {
  Expose(frame);
  if (!schedule_.ArrivesAt(frame)) return false;
  // what came first must have come: there is no estimate before it
  if (drop_probability_ > 0 && drops_.Uniform() < drop_probability_ && estimate_ != nullptr)
    return false;
  const int64_t number = schedule_.LatestAt(frame);
  if (estimator_) {
    world_.Develop(*Slot(number), number, whole_images_ ? std::nullopt : estimator_->Reach(),
                   &seen_);
    estimate_ = &estimator_->Update(seen_);
  } else {
    estimate_ = &true_pose_->Update(number, Slot(number)->true_X_HM);
  }
  Lap(timer_, LoopStage::kEstimate);
  return true;
}

std::string Eyes::name() const {
  return std::string(estimator_ ? estimator_->name() : NameOf(PoseSource::kTruePose));
}

Exposure* Eyes::Slot(int64_t number) {
  const int64_t n = std::ssize(exposures_);
  return &exposures_[static_cast<size_t>((number % n + n) % n)];
}

void Eyes::Expose(int64_t frame) {
  if (schedule_.ExposesAt(frame)) world_.Expose(Slot(schedule_.ExposedAt(frame)));
}

}  // namespace turbidock::trial
