#include "experiments/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "control/docking_procedure.h"
#include "control/thrust_allocation.h"
#include "control/visual_servo.h"
#include "sim/base/digest.h"
#include "sim/base/random.h"
#include "sim/base/units.h"
#include "sim/gl_context.h"
#include "sim/image_sensor.h"
#include "sim/plant.h"
#include "sim/scene.h"
#include "sim/sea.h"
#include "sim/stereo_renderer.h"
#include "sim/surfaces.h"
#include "sim/water.h"
#include "vision/rm_ga.h"

namespace turbidock::experiments {
namespace {

using control::Stage;

PoseError ErrorOf(const Pose& X_HM, const control::DesiredPose& desired) {
  return {X_HM.p.x() - desired.x_m, X_HM.p.y() - desired.y_m, X_HM.p.z() - desired.z_m,
          YawOf(X_HM.q) - desired.yaw_rad};
}

// The images under way from the sensor to the estimator.
class DelayLine {
 public:
  explicit DelayLine(int frames) : images_(frames + 1) {}

  StereoImage* Slot(int64_t frame) { return &images_[frame % std::ssize(images_)]; }
  // The image that arrives at `frame`, or null at the very beginning.
  const StereoImage* ArrivingAt(int64_t frame) {
    const int64_t exposed = frame - (std::ssize(images_) - 1);
    return exposed < 0 ? nullptr : Slot(exposed);
  }

 private:
  std::vector<StereoImage> images_;
};

// The vehicle in the water and its cameras.
class World {
 public:
  World(const Scenario& scenario, const TrialOptions& options)
      : seeds_(static_cast<uint64_t>(scenario.seed)),
        clock_(scenario.clock),
        scene_(sim::LoadScene(SceneFile(scenario), scenario.rig)),
        context_(sim::MakeOsmesaContext()),
        plant_(scene_, scenario.vehicle, clock_, sim::Sea(scenario.sea, seeds_.Stream("sea"))),
        renderer_(*context_, scene_),
        water_(scenario.optics, scenario.rig.MakeRig(), sim::SurfaceTable::FromScene(scene_),
               sim::LampPoses(scene_)),
        sensor_(scenario.sensor, seeds_.Stream("camera.left").NextU64(),
                seeds_.Stream("camera.right").NextU64()) {
    if (options.spectator)
      spectator_.emplace(*context_, scene_, options.spectator_width_px,
                         options.spectator_height_px);
    const Pose X_WH = scene_.X_WM * DrawStart(scenario);
    plant_.Reset(X_WH * scene_.X_BH.Inverse());
  }

  void Expose(int64_t frame, StereoImage* out) {
    renderer_.Render(plant_.data(), plant_.tick(), &rendered_);
    water_.Apply(rendered_, &radiance_);
    sensor_.Expose(radiance_, frame, out);
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
    for (int i = 0; i < clock_.ticks_per_frame; ++i) {
      if (auto fault = plant_.Step(command)) return fault;
      const sim::ContactReport now = plant_.contacts();
      contacts->dock_force_newton = std::max(contacts->dock_force_newton, now.dock_force_newton);
      if (now.collision_force_newton > contacts->collision_force_newton) {
        contacts->collision_force_newton = now.collision_force_newton;
        contacts->collision = now.collision;
      }
    }
    return std::nullopt;
  }

  Pose true_X_HM() const { return (plant_.truth().X_WB * scene_.X_BH).Inverse() * scene_.X_WM; }
  const sim::Plant& plant() const { return plant_; }
  const SeedTree& seeds() const { return seeds_; }

 private:
  SeedTree seeds_;
  ClockParams clock_;
  sim::Scene scene_;
  std::unique_ptr<sim::GlContext> context_;
  sim::Plant plant_;
  sim::StereoRenderer renderer_;
  sim::Water water_;
  sim::ImageSensor sensor_;
  std::optional<sim::SpectatorRenderer> spectator_;
  sim::RenderedStereo rendered_;
  sim::RadianceStereo radiance_;
  Image3u8 spectator_image_;
};

// The vehicle's own computer: images in, commands out.
class Autopilot {
 public:
  Autopilot(const Scenario& scenario, const SeedTree& seeds)
      : allocation_(scenario.allocation),
        estimator_(scenario.estimator, scenario.marker, scenario.hue, scenario.rig.MakeRig(),
                   seeds.Stream("vision.rm_ga")),
        procedure_(scenario.procedure, scenario.clock),
        servo_(scenario.servo, scenario.clock) {}

  ThrusterCommand Update(const StereoImage& seen) {
    estimate_ = &estimator_.Update(seen);
    directive_ = &procedure_.Update(*estimate_);
    const control::AxisVolts volts = directive_->control
                                         ? servo_.Update(*estimate_, directive_->desired)
                                         : directive_->open_loop;
    return control::Allocate(allocation_, volts);
  }

  const PoseEstimate& estimate() const { return *estimate_; }
  const control::Directive& directive() const { return *directive_; }

 private:
  control::AllocationParams allocation_;
  vision::RmGa estimator_;
  control::DockingProcedure procedure_;
  control::VisualServo servo_;
  const PoseEstimate* estimate_ = nullptr;
  const control::Directive* directive_ = nullptr;
};

void AddToDigest(const FrameRecord& record, Digest* digest) {
  digest->Add(record.frame);
  digest->Add(record.true_X_WB);
  digest->Add(record.true_V_WB_B.w);
  digest->Add(record.true_V_WB_B.v);
  digest->Add(record.est_X_HM);
  digest->Add(record.fitness);
  for (const double volts : record.command.volts) digest->Add(volts);
}

// Why the time was up: what the vehicle was still missing.
std::string TimeoutReason(const Scenario& scenario, const TrialResult& result,
                          const Autopilot& autopilot) {
  const std::string after = fmt::format("{:g} s are over", scenario.duration_s);
  if (result.log.frames.empty()) return after + " before the first image arrived";
  const control::Directive& directive = autopilot.directive();
  if (directive.stage == Stage::kApproach && result.log.transitions.empty())
    return fmt::format(
        "{} and the marker was never found: the best fitness was {:.2f}, it takes "
        "{:g} for {:g} s",
        after, result.fitness_best, scenario.procedure.found_fitness,
        scenario.procedure.found_hold_s);
  const PoseError& e = result.final_error_estimated;
  return fmt::format(
      "{} in {} with the marker estimated {:.0f} mm, {:.0f} mm, {:.0f} mm and {:.1f} deg from the "
      "desired pose",
      after, NameOf(directive.stage), units::MmFromM(e.x_m), units::MmFromM(e.y_m),
      units::MmFromM(e.z_m), units::DegFromRad(e.yaw_rad));
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

void Summarise(const Scenario& scenario, TrialResult* result) {
  double sum = 0;
  for (const FrameRecord& record : result->log.frames) {
    sum += record.fitness;
    result->fitness_best = std::max(result->fitness_best, record.fitness);
    result->stage_time_s[record.stage] += scenario.clock.frame_s();
    result->dock_force_max_newton =
        std::max(result->dock_force_max_newton, record.dock_force_newton);
    if (!result->first_dock_contact && record.dock_force_newton > 0)
      result->first_dock_contact = Contact{record.time_s, record.dock_force_newton};
  }
  if (!result->log.frames.empty()) result->fitness_mean = sum / std::ssize(result->log.frames);
  for (const control::Transition& change : result->log.transitions)
    result->returns_to_servoing +=
        change.from == Stage::kDocking && change.to == Stage::kVisualServoing;
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
  World world(scenario, options);
  Autopilot autopilot(scenario, world.seeds());
  DelayLine delay(scenario.camera_delay_frames);

  TrialResult result;
  result.seed = scenario.seed;
  Digest digest;
  const int64_t last_frame = scenario.clock.FramesFor(scenario.duration_s);
  const int64_t hold_frames = scenario.clock.FramesFor(scenario.docked_hold_s);
  result.log.frames.reserve(static_cast<size_t>(last_frame + hold_frames + 1));
  std::optional<int64_t> docked_frame;
  std::optional<Outcome> end;

  int64_t frame = 0;
  for (; !end; ++frame) {
    world.Expose(frame, delay.Slot(frame));
    const StereoImage* seen = delay.ArrivingAt(frame);
    ThrusterCommand command;
    FrameRecord record;
    if (seen) {
      command = autopilot.Update(*seen);
      const sim::VehicleTruth truth = world.plant().truth();
      const control::Directive& directive = autopilot.directive();
      record = {.frame = frame,
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
      if (directive.transition) {
        result.log.transitions.push_back(*directive.transition);
        if (options.on_transition) options.on_transition(*directive.transition);
      }
      if (directive.stage == Stage::kDocked && !docked_frame) {
        docked_frame = frame;
        result.docked = true;
      }
      if (!docked_frame || docked_frame == frame) {
        result.time_s = record.time_s;
        result.final_error_true = ErrorOf(record.true_X_HM, directive.desired);
        result.final_error_estimated = ErrorOf(record.est_X_HM, directive.desired);
      }
      if (directive.given_up) end = Outcome::kMarkerLost;
    }

    sim::ContactReport contacts;
    const std::optional<std::string> fault = world.Advance(command, &contacts);
    if (seen) {
      record.dock_force_newton = contacts.dock_force_newton;
      record.collision_force_newton = contacts.collision_force_newton;
      AddToDigest(record, &digest);
      result.log.frames.push_back(record);
      if (options.observe) options.observe({record, *seen, world.DrawSpectator()});
    }

    if (fault) {
      end = Outcome::kDiverged;
      result.reason = *fault;
    } else if (contacts.collision_force_newton > 0) {
      end = Outcome::kCollision;
      result.reason =
          fmt::format("{} at {:.1f} s with {:.1f} N", contacts.collision,
                      scenario.clock.TimeOfFrame(frame + 1), contacts.collision_force_newton);
    } else if (options.stop_requested && options.stop_requested()) {
      end = Outcome::kInterrupted;
      result.reason = fmt::format("stopped at {:.1f} s", scenario.clock.TimeOfFrame(frame + 1));
    } else if (docked_frame) {
      if (frame + 1 - *docked_frame >= hold_frames) end = Outcome::kDocked;
    } else if (frame + 1 >= last_frame && !end) {
      end = Outcome::kTimeout;
    }
  }

  const sim::PoleInDock pole = world.plant().pole();
  result.inserted = pole.inserted;
  result.insertion_depth_m = pole.insertion_depth_m;
  Summarise(scenario, &result);
  if (end == Outcome::kDocked && !result.inserted) end = Outcome::kFalseDock;
  result.outcome = *end;
  if (result.docked && result.reason.empty()) result.reason = DockedReason(result);
  if (end == Outcome::kTimeout) result.reason = TimeoutReason(scenario, result, autopilot);
  if (end == Outcome::kMarkerLost)
    result.reason = autopilot.directive().given_up_reason;
  result.digest = digest.Hex();
  result.wall_time_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count();
  result.real_time_factor = scenario.clock.TimeOfFrame(frame) / result.wall_time_s;
  return result;
}

}  // namespace turbidock::experiments
