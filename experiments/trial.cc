#include "experiments/trial.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "control/docking_procedure.h"
#include "control/thrust_allocation.h"
#include "control/visual_servo.h"
#include "experiments/camera_schedule.h"
#include "sim/base/digest.h"
#include "sim/base/random.h"
#include "sim/base/units.h"
#include "sim/gl_context.h"
#include "sim/plant.h"
#include "sim/scene.h"
#include "sim/sea.h"
#include "sim/stereo_camera.h"
#include "sim/stereo_renderer.h"
#include "sim/surfaces.h"
#include "vision/rm_ga.h"

namespace turbidock::experiments {
namespace {

using control::Stage;

constexpr int kSpectatorWidth_px = 320, kSpectatorHeight_px = 240;

// Twenty minutes of frames; a longer log grows as it goes.
constexpr int64_t kReservedFrames = 36000;

PoseError ErrorOf(const Pose& X_HM, const control::DesiredPose& desired) {
  return {X_HM.p.x() - desired.x_m, X_HM.p.y() - desired.y_m, X_HM.p.z() - desired.z_m,
          WrapAngle(YawOf(X_HM.q) - desired.yaw_rad)};
}

// An instant at which the cameras were exposed.
struct Exposure {
  int64_t tick = 0;
  std::vector<mjtNum> qpos;  // where everything was
};

// The latest exposures by their numbers: those under way from the sensor to the estimator, and the
// one there. They become images when they arrive: only then is it known which pixels matter.
class DelayLine {
 public:
  explicit DelayLine(int under_way) : exposures_(static_cast<size_t>(under_way) + 1) {}

  Exposure* Slot(int64_t number) {
    const int64_t n = std::ssize(exposures_);
    return &exposures_[static_cast<size_t>((number % n + n) % n)];
  }

 private:
  std::vector<Exposure> exposures_;
};

// The vehicle in the water and its cameras.
class World {
 public:
  World(const Scenario& scenario, const TrialOptions& options)
      : seeds_(static_cast<uint64_t>(scenario.seed)),
        clock_(scenario.clock),
        scene_(sim::LoadScene(SceneFile(scenario), scenario.rig)),
        context_(sim::MakeGlContext(scenario.renderer, &context_remark_)),
        plant_(scene_, scenario.vehicle, clock_, sim::Sea(scenario.sea, seeds_.Stream("sea"))),
        renderer_(*context_, scene_),
        camera_(sim::Water(scenario.optics, scenario.rig.MakeRig(),
                           sim::SurfaceTable::FromScene(scene_), sim::LampPoses(scene_)),
                sim::ImageSensor(scenario.sensor, seeds_.Stream("camera.left").NextU64(),
                                 seeds_.Stream("camera.right").NextU64())),
        exposed_(mj_makeData(scene_.model.get())),
        timer_(options.timer) {
    CheckMarker(scenario, scene_);
    if (options.spectator)
      spectator_.emplace(*context_, scene_, kSpectatorWidth_px, kSpectatorHeight_px);
    const Pose X_WH = scene_.X_WM * DrawStart(scenario);
    plant_.Reset(X_WH * scene_.X_BH.Inverse());
  }

  void Expose(Exposure* exposure) const {
    const mjData& data = plant_.data();
    exposure->tick = plant_.tick();
    exposure->qpos.assign(data.qpos, data.qpos + scene_.model->nq);
  }

  // The images of an exposure, or a region of them.
  void Develop(const Exposure& exposure, int64_t number, const std::optional<StereoRegion>& region,
               StereoImage* out) {
    std::copy(exposure.qpos.begin(), exposure.qpos.end(), exposed_->qpos);
    mj_kinematics(scene_.model.get(), exposed_.get());
    mj_camlight(scene_.model.get(), exposed_.get());
    const StereoRegion needed = region.value_or(camera_.whole());
    renderer_.Render(*exposed_, exposure.tick, camera_.Seen(needed), &rendered_, timer_);
    camera_.Expose(rendered_, needed, number, out, timer_);
  }

  const Image3u8* DrawSpectator() {
    if (!spectator_) return nullptr;
    spectator_->Render(plant_.data(), scene_.spectator_camera, &spectator_image_);
    return &spectator_image_;
  }

  // Lets a frame's time pass under a command. Contacts are the strongest of its ticks. Returns why
  // the physics failed, if it did.
  std::optional<std::string> Advance(const ThrusterCommand& command, sim::ContactReport* contacts) {
    *contacts = {};
    std::optional<std::string> fault;
    for (int i = 0; i < clock_.ticks_per_frame; ++i) {
      if ((fault = plant_.Step(command))) break;
      const sim::ContactReport now = plant_.contacts();
      contacts->dock_force_newton = std::max(contacts->dock_force_newton, now.dock_force_newton);
      if (now.collision_force_newton > contacts->collision_force_newton) {
        contacts->collision_force_newton = now.collision_force_newton;
        contacts->collision = now.collision;
      }
    }
    Lap(timer_, LoopStage::kPhysics);
    return fault;
  }

  Pose true_X_HM() const { return (plant_.truth().X_WB * scene_.X_BH).Inverse() * scene_.X_WM; }
  const sim::Plant& plant() const { return plant_; }
  const SeedTree& seeds() const { return seeds_; }
  std::string renderer() const { return context_->description(); }
  const std::string& context_remark() const { return context_remark_; }

 private:
  SeedTree seeds_;
  ClockParams clock_;
  sim::Scene scene_;
  std::string context_remark_;  // why it is not the kind asked for, or empty
  std::unique_ptr<sim::GlContext> context_;
  sim::Plant plant_;
  sim::StereoRenderer renderer_;
  sim::StereoCamera camera_;
  std::optional<sim::SpectatorRenderer> spectator_;
  sim::MjDataPtr exposed_;  // everything where it was at an exposure
  sim::RenderedStereo rendered_;
  Image3u8 spectator_image_;
  StageTimer* timer_;
};

// The vehicle's own computer: images in, commands out.
class Autopilot {
 public:
  Autopilot(const Scenario& scenario, const SeedTree& seeds, StageTimer* timer)
      : timer_(timer),
        allocation_(scenario.allocation),
        estimator_(scenario.estimator, scenario.marker, scenario.hue, scenario.rig.MakeRig(),
                   seeds.Stream("vision.rm_ga")),
        procedure_(scenario.procedure, scenario.image_clock()),
        servo_(scenario.servo, scenario.image_clock()) {
    estimator_.set_timer(timer);
  }

  ThrusterCommand Update(const StereoImage& seen) {
    estimate_ = &estimator_.Update(seen);
    Lap(timer_, LoopStage::kEstimate);
    directive_ = &procedure_.Update(*estimate_);
    const control::AxisVolts volts = directive_->control
                                         ? servo_.Update(*estimate_, directive_->desired)
                                         : directive_->open_loop;
    const ThrusterCommand command = control::Allocate(allocation_, volts);
    Lap(timer_, LoopStage::kControl);
    return command;
  }

  // The pixels that the next Update can read; nothing: any.
  std::optional<StereoRegion> Reach() const { return estimator_.Reach(); }
  const PoseEstimate& estimate() const { return *estimate_; }
  const control::Directive& directive() const { return *directive_; }

 private:
  StageTimer* timer_;
  const PoseEstimate* estimate_ = nullptr;
  const control::Directive* directive_ = nullptr;
  control::AllocationParams allocation_;
  vision::RmGa estimator_;
  control::DockingProcedure procedure_;
  control::VisualServo servo_;
};

double PeakMemoryMib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;  // Linux counts KiB
}

void AddToDigest(const FrameRecord& record, Digest* digest) {
  digest->Add(record.frame);
  digest->Add(record.true_X_WB);
  digest->Add(record.true_V_WB_B.w);
  digest->Add(record.true_V_WB_B.v);
  digest->Add(record.est_X_HM);
  digest->Add(record.fitness);
  for (const double volts : record.command.volts) digest->Add(volts);
}

// What a jam adds to a reason.
std::string JamRemark(const TrialResult& result) {
  return result.jam_time_s
             ? fmt::format("; the pole jammed in the dock at {:.1f} s", *result.jam_time_s)
             : "";
}

// Why the time was up: what the vehicle was still missing.
std::string TimeoutReason(const Scenario& scenario, const TrialResult& result,
                          const control::Directive& directive) {
  const std::string after = fmt::format("{:g} s are over", scenario.duration_s);
  if (directive.stage == Stage::kApproach && result.log.transitions.empty())
    return fmt::format(
        "{} and the marker was never found: the best fitness was {:.2f}, it takes "
        "{:g} for {:g} s",
        after, result.fitness_best, scenario.procedure.found_fitness,
        scenario.procedure.found_hold_s);
  const PoseError& e = result.final_error_estimated;
  return fmt::format(
             "{} in {} with the marker estimated {:.0f} mm, {:.0f} mm, {:.0f} mm and {:.1f} deg "
             "from the desired pose",
             after, NameOf(directive.stage), units::MmFromM(e.x_m), units::MmFromM(e.y_m),
             units::MmFromM(e.z_m), units::DegFromRad(e.yaw_rad)) +
         JamRemark(result);
}

std::string DockedReason(const TrialResult& result) {
  const std::string met =
      fmt::format("the docking criterion was met after {:.1f} s", result.time_s);
  if (result.inserted)
    return fmt::format("{} and the pole is in the hole, {:.0f} mm past the mouth", met,
                       units::MmFromM(result.insertion_depth_m));
  return fmt::format(
      "{} on the estimate, but the pole is not in the hole: its tip is {:.0f} mm {} "
      "the mouth and the true position of the marker is off by {:.0f} mm in y and "
      "{:.0f} mm in z",
      met, units::MmFromM(std::abs(result.insertion_depth_m)),
      result.insertion_depth_m < 0 ? "in front of" : "past",
      units::MmFromM(result.final_error_true.y_m), units::MmFromM(result.final_error_true.z_m));
}

// Sums over the frames.
void Summarise(const Scenario& scenario, TrialResult* result) {
  double sum = 0;
  std::map<Stage, int64_t> frames;
  for (const FrameRecord& record : result->log.frames) {
    sum += record.fitness;
    result->fitness_best = std::max(result->fitness_best, record.fitness);
    ++frames[record.stage];
  }
  for (const auto& [stage, count] : frames)
    result->stage_time_s[stage] = scenario.clock.TimeOfFrame(count);
  result->fitness_mean = sum / static_cast<double>(result->log.frames.size());
  for (const control::Transition& change : result->log.transitions)
    result->returns_to_servoing +=
        change.from == Stage::kDocking && change.to == Stage::kVisualServoing;
}

FrameRecord RecordOf(const Scenario& scenario, int64_t frame, const World& world,
                     const Autopilot& autopilot, const ThrusterCommand& command) {
  const sim::VehicleTruth truth = world.plant().truth();
  const control::Directive& directive = autopilot.directive();
  return {.frame = frame,
          .time_s = scenario.clock.TimeOfFrame(frame),
          .stage = directive.stage,
          .est_X_HM = autopilot.estimate().X_HM,
          .fitness = autopilot.estimate().fitness,
          .true_X_HM = world.true_X_HM(),
          .true_X_WB = truth.X_WB,
          .true_V_WB_B = truth.V_WB_B,
          .desired = directive.desired,
          .controlled = directive.control,
          .command = command,
          .insertion_depth_m = world.plant().pole().insertion_depth_m};
}

}  // namespace

Pose DrawStart(const Scenario& scenario) {
  Rng rng = SeedTree(static_cast<uint64_t>(scenario.seed)).Stream("start");
  const StartParams& s = scenario.start;
  const double distance_m = rng.Uniform(s.distance_min_m, s.distance_max_m);
  const double y_m = rng.Uniform(-s.lateral_m, s.lateral_m);
  const double z_m = rng.Uniform(-s.vertical_m, s.vertical_m);
  const double yaw_rad = rng.Uniform(-s.heading_rad, s.heading_rad);
  return {FromYawPitchRoll(yaw_rad, 0, 0), {-distance_m, y_m, z_m}};
}

TrialResult RunTrial(const Scenario& scenario, const TrialOptions& options) {
  const auto wall_start = std::chrono::steady_clock::now();
  CheckFields(scenario, "");
  const ClockParams& clock = scenario.clock;
  World world(scenario, options);
  if (options.on_remark && !world.context_remark().empty())
    options.on_remark(world.context_remark());
  Autopilot autopilot(scenario, world.seeds(), options.timer);
  DockContact dock_contact(scenario.jam);
  // The cameras have been on for a while: the images that arrive first show the vehicle at its
  // start.
  const CameraSchedule cameras(scenario.camera_period_frames, scenario.camera_delay_frames);
  DelayLine exposures(cameras.under_way());
  const auto expose = [&](int64_t frame) {
    if (cameras.ExposesAt(frame)) world.Expose(exposures.Slot(cameras.ExposedAt(frame)));
  };
  for (int64_t frame = cameras.first_frame(); frame < 0; ++frame) expose(frame);
  const bool whole_images = options.whole_images || !scenario.region_of_interest;
  StereoImage seen;

  TrialResult result;
  result.seed = scenario.seed;
  result.renderer = world.renderer();
  Digest digest;
  const int64_t last_frame = clock.FramesFor(scenario.duration_s);
  const int64_t hold_frames = clock.FramesFor(scenario.docked_hold_s);
  result.log.frames.reserve(
      static_cast<size_t>(std::min(last_frame + hold_frames, kReservedFrames)));
  std::optional<int64_t> docked_frame;
  std::optional<Outcome> end;
  if (options.timer) options.timer->Skip();

  ThrusterCommand command;
  int64_t frame = 0;
  for (; !end; ++frame) {
    expose(frame);
    const bool arrives = cameras.ArrivesAt(frame);
    if (arrives) {
      const int64_t number = cameras.LatestAt(frame);
      world.Develop(*exposures.Slot(number), number,
                    whole_images ? std::nullopt : autopilot.Reach(), &seen);
      command = autopilot.Update(seen);
    }
    const control::Directive& directive = autopilot.directive();
    FrameRecord record = RecordOf(scenario, frame, world, autopilot, command);
    if (arrives && directive.transition) {
      control::Transition change = *directive.transition;
      change.frame = frame;  // when the vehicle acts, not when the image was exposed
      result.log.transitions.push_back(change);
      if (options.on_transition) options.on_transition(change);
    }
    if (directive.stage == Stage::kDocked && !docked_frame) docked_frame = frame;
    if (!docked_frame || docked_frame == frame) {
      result.time_s = record.time_s;
      result.final_error_true = ErrorOf(record.true_X_HM, directive.desired);
      result.final_error_estimated = ErrorOf(record.est_X_HM, directive.desired);
    }
    const Image3u8* spectator = world.DrawSpectator();
    const bool inserted = world.plant().pole().inserted;
    Lap(options.timer, LoopStage::kLog);

    sim::ContactReport contacts;
    const std::optional<std::string> fault = world.Advance(command, &contacts);
    record.dock_force_newton = contacts.dock_force_newton;
    record.collision_force_newton = contacts.collision_force_newton;
    dock_contact.Update({.time_s = record.time_s,
                         .insertion_depth_m = record.insertion_depth_m,
                         .inserted = inserted,
                         .dock_force_newton = contacts.dock_force_newton});
    AddToDigest(record, &digest);
    result.log.frames.push_back(record);
    Lap(options.timer, LoopStage::kLog);
    if (options.observe)
      options.observe({record, seen, arrives ? autopilot.estimate().evaluations : 0, spectator});
    if (options.timer) options.timer->Skip();

    const double now_s = clock.TimeOfFrame(frame + 1);
    if (fault) {
      end = Outcome::kDiverged;
      result.reason = *fault;
    } else if (contacts.collision_force_newton > 0) {
      end = Outcome::kCollision;
      result.reason = fmt::format("{} at {:.1f} s with {:.1f} N", contacts.collision, now_s,
                                  contacts.collision_force_newton);
    } else if (directive.given_up) {
      end = Outcome::kMarkerLost;
      result.reason = directive.given_up_reason;
    } else if (options.stop_requested && options.stop_requested()) {
      end = Outcome::kInterrupted;
      result.reason = fmt::format("stopped at {:.1f} s", now_s);
    } else if (docked_frame) {
      if (frame + 1 - *docked_frame >= hold_frames) end = Outcome::kDocked;
    } else if (frame + 1 >= last_frame) {
      end = Outcome::kTimeout;
    }
  }

  const sim::PoleInDock pole = world.plant().pole();
  const sim::VehicleTruth truth = world.plant().truth();
  digest.Add(truth.X_WB);
  digest.Add(truth.V_WB_B.w);
  digest.Add(truth.V_WB_B.v);
  dock_contact.Update({.time_s = clock.TimeOfFrame(frame),
                       .insertion_depth_m = pole.insertion_depth_m,
                       .inserted = pole.inserted});
  result.docked = docked_frame.has_value();
  if (!result.docked) result.time_s = clock.TimeOfFrame(frame);
  result.inserted = pole.inserted;
  result.insertion_depth_m = pole.insertion_depth_m;
  result.insertion_time_s = dock_contact.insertion_time_s();
  result.first_dock_contact = dock_contact.first_contact();
  result.dock_force_max_newton = dock_contact.force_max_newton();
  result.jam_time_s = dock_contact.jam_time_s();
  result.energy = world.plant().energy();
  Summarise(scenario, &result);
  if (end == Outcome::kDocked) {
    if (!result.inserted) end = Outcome::kFalseDock;
    result.reason = DockedReason(result);
  }
  if (end == Outcome::kTimeout)
    result.reason = TimeoutReason(scenario, result, autopilot.directive());
  result.outcome = *end;
  result.digest = digest.Hex();
  result.wall_time_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count();
  result.peak_memory_mib = PeakMemoryMib();
  result.real_time_factor = clock.TimeOfFrame(frame) / result.wall_time_s;
  return result;
}

}  // namespace turbidock::experiments
