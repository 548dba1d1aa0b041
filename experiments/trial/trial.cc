#include "experiments/trial/trial.h"

#include <optional>

#include "experiments/system/build_info.h"
#include "experiments/trial/ending.h"
#include "experiments/trial/eyes.h"
#include "experiments/trial/recorder.h"
#include "experiments/trial/world.h"

namespace turbidock::trial {
namespace {

FrameRecord RecordOf(const Scenario& scenario, int64_t frame, const World& world,
                     const PoseEstimate& estimate, const control::Autopilot& autopilot,
                     const ThrusterCommand& command) {
  const vehicle::VehicleTruth truth = world.plant().truth();
  const control::Directive& directive = autopilot.directive();
  return {.frame = frame,
          .time_s = scenario.clock.TimeOfFrame(frame),
          .stage = directive.stage,
          .est_X_HM = estimate.X_HM,
          .fitness = estimate.fitness,
          .true_X_HM = world.true_X_HM(),
          .true_X_WB = truth.X_WB,
          .true_V_WB_B = truth.V_WB_B,
          .desired = directive.desired,
          .controlled = directive.control,
          .demand = autopilot.demand(),
          .command = command,
          .insertion_depth_m = world.plant().pole().insertion_depth_m};
}

}  // namespace

TrialResult RunTrial(const Scenario& scenario, const TrialOptions& options) {
  CheckFields(scenario, "");
  TrialRecorder recorder(scenario);
  World world(scenario, options);
  if (options.on_remark && !world.remark().empty()) options.on_remark(world.remark());
  Eyes eyes(scenario, options, &world);
  control::Autopilot autopilot(scenario.control, scenario.procedure, scenario.image_clock());
  EndingRules rules(scenario);
  if (options.timer) options.timer->Skip();

  ThrusterCommand command;
  std::optional<Ending> ending;
  for (int64_t frame = 0; !ending; ++frame) {
    const TrialExcitation excitation = options.excite ? options.excite(frame) : TrialExcitation();
    const bool arrives = eyes.Update(frame);
    if (arrives) {
      command = autopilot.Update(eyes.estimate(), excitation.control);
      Lap(options.timer, LoopStage::kControl);
    }
    world.Push(excitation.F_B_B);
    const control::Directive& directive = autopilot.directive();
    FrameRecord record = RecordOf(scenario, frame, world, eyes.estimate(), autopilot, command);
    if (arrives && directive.transition) {
      control::Transition change = *directive.transition;
      change.frame = frame;  // when the vehicle acts, not when the image was exposed
      recorder.Add(change);
      if (options.on_transition) options.on_transition(change);
    }
    const Image3u8* spectator = world.DrawSpectator();
    const bool inserted = world.plant().pole().inserted;
    Lap(options.timer, LoopStage::kLog);

    vehicle::ContactReport contacts;
    const std::optional<std::string> fault = world.Advance(command, &contacts);
    Lap(options.timer, LoopStage::kPhysics);
    record.dock_force_newton = contacts.dock_force_newton;
    record.collision_force_newton = contacts.collision_force_newton;
    recorder.Add(record, inserted);
    Lap(options.timer, LoopStage::kLog);
    if (options.observe)
      options.observe({record, eyes.seen(), arrives ? eyes.estimate().evaluations : 0, spectator});
    if (options.timer) options.timer->Skip();

    ending = rules.After({.frame = frame,
                          .directive = directive,
                          .fault = fault,
                          .contacts = contacts,
                          .stop_requested = options.stop_requested && options.stop_requested()});
  }
  TrialResult result = recorder.Finish(world.plant(), autopilot.directive(), *ending);
  result.estimator = eyes.name();
  result.version = system::VersionAndCommit();
  result.renderer = world.renderer();
  return result;
}

}  // namespace turbidock::trial
