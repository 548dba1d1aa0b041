#include "experiments/trial/running_trial.h"

#include <fmt/ranges.h>

#include <filesystem>
#include <utility>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/report/json.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/series.h"
#include "experiments/trial/switched_off.h"
#include "vision/normalised_error.h"

namespace turbidock::trial {
namespace {

// The groups and keys that a running trial can follow, by the part of it that does.
enum class Part { kOptics, kSea, kControl };
constexpr std::pair<const char*, Part> kParts[] = {
    {"water", Part::kOptics},         {"lights.lamps", Part::kOptics},
    {"lights.marker", Part::kOptics}, {"sea", Part::kSea},
    {"control.use", Part::kControl},  {"control.levelling", Part::kControl}};

std::string KeyIn(const std::string& assignment) {
  return assignment.substr(0, assignment.find('='));
}

// ConfigError for what no part follows.
Part PartOf(const std::string& key, const Plugins& plugins) {
  const auto is_in = [&key](const std::string& name) {
    return key == name || key.starts_with(name + ".") || key.starts_with(name + "[");
  };
  std::vector<std::string> names;
  for (const auto& [name, part] : kParts) {
    if (is_in(name)) return part;
    names.emplace_back(name);
  }
  for (const std::string& controller : plugins.controllers()) {
    if (plugins.Spec(controller).commands) continue;  // they are read when the trial begins
    names.push_back(JoinKey("control", controller));
    if (is_in(names.back())) return Part::kControl;
  }
  throw ConfigError(
      key, fmt::format("cannot change while the trial runs; {} can", fmt::join(names, ", ")));
}

control::VehicleModel KnownVehicle(const Scenario& scenario, const vehicle::Scene& scene) {
  control::VehicleModel model = ModelOf(scenario.known_vehicle, scene);
  model.images = scenario.image_times();
  return model;
}

const Scenario& Checked(const Scenario& scenario) {
  CheckFields(scenario, "");
  return scenario;
}

}  // namespace

RunningTrial::RunningTrial(const Scenario& scenario, TrialOptions options)
    : scenario_(Checked(scenario)),
      model_files_(ModelFilesOf(scenario_)),
      settings_(scenario_),
      options_(std::move(options)),
      recorder_(scenario_),
      world_(scenario_, options_),
      perception_(scenario_, options_, &world_),
      autopilot_(scenario_.ControlInUse(), scenario_.procedure,
                 KnownVehicle(scenario_, world_.scene()), scenario_.image_clock(),
                 scenario_.approach),
      rules_(scenario_),
      command_(ThrusterCommand::Neutral(world_.scene().thrusters.size())) {
  recorder_.SetThrusters(vehicle::NamesOf(world_.scene().thrusters));
  recorder_.SetStart(StartOf(scenario_, world_.scene(), world_.plant().X_WM()).X_MH);
  if (const auto commands = scenario_.plugins.Spec().commands)
    commands_ = commands(ModelOf(scenario_.known_vehicle, world_.scene()), scenario_.duration_s);
  if (options_.on_remark)
    for (const std::string& remark : {ChangedModels(scenario_, model_files_), world_.remark()})
      if (!remark.empty()) options_.on_remark(remark);
  if (options_.on_remark)
    for (const std::string& remark : RemarksOn(scenario_)) options_.on_remark(remark);
  if (options_.timer) options_.timer->Skip();
}

FrameRecord RunningTrial::RecordOf(int64_t frame) const {
  const vehicle::VehicleTruth truth = world_.plant().truth();
  const control::Directive& directive = autopilot_.directive();
  const PoseEstimate& estimate = perception_.estimate();
  return {.frame = frame,
          .time_s = scenario_.clock.TimeOfFrame(frame),
          .stage = directive.stage,
          .est_X_HM = estimate.X_HM,
          .fitness = estimate.fitness,
          .normalised_error2 = vision::NormalisedError2(estimate, perception_.true_at_image_X_HM()),
          .image_time_s = perception_.image_time_s(),
          .true_at_image_X_HM = perception_.true_at_image_X_HM(),
          .true_X_HM = world_.true_X_HM(),
          .true_X_WB = truth.X_WB,
          .true_V_WB_B = truth.V_WB_B,
          .navigated_MH = autopilot_.navigated_MH(),
          .uncorrected_MH = autopilot_.uncorrected_MH(),
          .desired = directive.desired,
          .controlled = directive.control,
          .demand = autopilot_.demand(),
          .command = command_,
          .insertion_depth_m = world_.plant().pole().insertion_depth_m,
          .inserted = world_.plant().pole().inserted};
}

void RunningTrial::Step() {
  TD_CHECK(!ended(), "a trial under way");
  const int64_t frame = next_frame_++;
  const TrialExcitation excitation = options_.excite ? options_.excite(frame) : TrialExcitation();
  const bool arrives = perception_.Update(frame);
  if (arrives) {
    const auto reading = scenario_.approach.on() ? world_.ReadNavigation() : std::nullopt;
    attitude_ = world_.ReadAttitude();
    command_ = autopilot_.Update(perception_.estimate(), excitation.control, attitude_, reading);
    Lap(options_.timer, LoopStage::kControl);
  }
  if (commands_) command_ = commands_(world_.plant().time_s());
  Wrench outside_F_B = excitation.F_B_B;
  if (!push_f_W_.isZero(0)) outside_F_B.f += world_.plant().truth().X_WB.q.conjugate() * push_f_W_;
  world_.ApplyWrench(outside_F_B);
  const control::Directive& directive = autopilot_.directive();
  FrameRecord record = RecordOf(frame);
  if (arrives && directive.transition) {
    control::Transition change = *directive.transition;
    change.frame = frame;  // when the vehicle acts, not when the image was exposed
    recorder_.Add(change);
    if (options_.on_transition) options_.on_transition(change);
  }
  const Image3u8* spectator = world_.DrawSpectator();
  Lap(options_.timer, LoopStage::kLog);

  vehicle::ContactReport contacts;
  const std::optional<std::string> fault = Advance(&contacts);
  Lap(options_.timer, LoopStage::kPhysics);
  record.dock_force_newton = contacts.dock_force_newton;
  record.collision_force_newton = contacts.collision_force_newton;
  recorder_.Add(record);
  Lap(options_.timer, LoopStage::kLog);
  if (options_.observe)
    options_.observe({record, perception_.latest_images(),
                      arrives ? perception_.estimate().evaluations : 0, spectator});
  if (options_.timer) options_.timer->Skip();

  ending_ = rules_.After({.frame = frame,
                          .directive = directive,
                          .fault = fault,
                          .contacts = contacts,
                          .stop_requested = options_.stop_requested && options_.stop_requested()});
}

std::optional<std::string> RunningTrial::Advance(vehicle::ContactReport* contacts) {
  std::function<void(const ThrusterCommand&)> observe;
  if (options_.on_tick)
    observe = [this](const ThrusterCommand& command) {
      options_.on_tick({.time_s = world_.plant().time_s(),
                        .truth = world_.plant().truth(),
                        .command = command,
                        .demand = autopilot_.demand(),
                        .water_v_W = world_.plant().water().v_W,
                        .measured = attitude_});
    };
  return world_.AdvanceBy(
      [this](double time_s) -> const ThrusterCommand& {
        return commands_ ? commands_(time_s) : command_;
      },
      contacts, observe);
}

Scenario Changed(const Scenario& settings, const std::string& assignment) {
  Scenario next = settings;
  PartOf(KeyIn(assignment), settings.plugins);
  Resolve({config::ParseAssignment(assignment)}, &next);
  if (next.plays_back() != settings.plays_back() ||
      next.sea.current.file.path != settings.sea.current.file.path)
    throw ConfigError(KeyIn(assignment), "what is read from a file cannot change while it runs");
  if (config::TextOf(next, "water.snow") != config::TextOf(settings, "water.snow"))
    throw ConfigError(KeyIn(assignment), "snow cannot change while the trial runs");
  return next;
}

void RunningTrial::Set(const std::string& assignment) {
  Scenario next = Changed(settings_, assignment);
  const std::string key = KeyIn(assignment);
  switch (PartOf(key, settings_.plugins)) {
    case Part::kOptics:
      world_.SetOptics(next);
      break;
    case Part::kSea:
      world_.SetSea(next.sea);
      break;
    case Part::kControl:
      autopilot_.SetControl(next.ControlInUse());
      break;
  }
  settings_ = std::move(next);
  AddChange(key, assignment.substr(key.size() + 1));
}

void RunningTrial::Push(const Eigen::Vector3d& f_W_newton) {
  TD_CHECK(f_W_newton.allFinite(), "a force");
  if (f_W_newton == push_f_W_) return;
  push_f_W_ = f_W_newton;
  AddChange("push", fmt::format("[{}, {}, {}]", FormatNumber(f_W_newton.x()),
                                FormatNumber(f_W_newton.y()), FormatNumber(f_W_newton.z())));
}

void RunningTrial::AddChange(const std::string& key, const std::string& value) {
  recorder_.Add(Change{.frame = next_frame_,
                       .time_s = scenario_.clock.TimeOfFrame(next_frame_),
                       .key = key,
                       .value = value});
}

TrialResult RunTrial(const Scenario& scenario, const TrialOptions& options) {
  RunningTrial trial(scenario, options);
  while (!trial.ended()) trial.Step();
  return trial.Finish();
}

void WriteRecords(const std::string& folder, const Scenario& scenario, const TrialResult& result) {
  const std::filesystem::path out(folder);
  system::MakeFolder(folder);
  system::WriteWhole(out / "resolved.yaml", SaveResolved(scenario, result.model_files));
  system::WriteWhole(out / "trajectory.csv", Series::Of(result.log).Csv());
  system::WriteWhole(out / "result.json", report::JsonText(result));
}

TrialResult RunningTrial::Finish() {
  TD_CHECK(next_frame_ > 0, "a result needs a frame");
  if (!ending_)
    ending_ = Ending{Outcome::kInterrupted,
                     fmt::format("stopped at {:.1f} s", scenario_.clock.TimeOfFrame(next_frame_))};
  TrialResult result = recorder_.Finish(world_.plant(), autopilot_.directive(), *ending_);
  result.reason += perception_.RepeatRemark();
  result.repeated_images = perception_.repeated_images();
  result.estimator = perception_.name();
  result.version = system::VersionAndCommit();
  result.renderer = world_.renderer();
  result.model_files = model_files_;
  return result;
}

}  // namespace turbidock::trial
