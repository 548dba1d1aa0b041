#include "experiments/studies/live/live_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "experiments/config/yaml_fields.h"

namespace turbidock::live {
namespace {

using report::Json;

constexpr double kSlowest = 0.05, kFastest = 100;  // times real time
constexpr int kMostSteps = 1000;
constexpr double kStrongestPush_newton = 50;

template <class Enum>
std::vector<std::string> NamesOf() {
  std::vector<std::string> names;
  names.reserve(std::size(EnumNames<Enum>::kNames));
  for (const auto& [value, name] : EnumNames<Enum>::kNames) names.emplace_back(name);
  return names;
}

// Gains from nothing to far too much.
void AddGains(control::Law law, std::vector<Control>* controls) {
  const auto add = [&](const std::string& key, const std::string& label, const std::string& unit,
                       double high, double low = 0) {
    controls->push_back({NameOf(law) + ("." + key), label, "control", unit, low, high});
  };
  switch (law) {
    case control::Law::kPVoltage:
      for (const char* axis : {"surge", "sway", "heave"})
        add(axis + std::string(".kp_v_per_m"), std::string(axis) + " kp", "V/m", 120);
      add("yaw.kp_v", "yaw kp", "V", 20);
      return;
    case control::Law::kPid:
      for (const char* axis : {"surge", "sway", "heave"}) {
        add(axis + std::string(".kp_per_s2"), std::string(axis) + " kp", "1/s²", 20);
        add(axis + std::string(".ki_per_s3"), std::string(axis) + " ki", "1/s³", 20);
        add(axis + std::string(".kd_per_s"), std::string(axis) + " kd", "1/s", 20);
      }
      add("yaw.kp_per_s2", "yaw kp", "1/s²", 45);
      add("yaw.kd_per_s", "yaw kd", "1/s", 15);
      return;
    case control::Law::kLqg:
      // the error that the law takes as seriously as effort_share: small is tight
      for (const char* axis : {"surge", "sway", "heave"})
        add(axis + std::string(".error_m"), std::string(axis) + " error weight", "m", 0.1, 0.001);
      add("yaw.error_rad", "yaw error weight", "rad", 0.5, 0.005);
      return;
  }
}

// What is missing or wrong in a command.
[[noreturn]] void Fail(const std::string& problem) { throw ConfigError("command", problem); }

const Json& Member(const Json& command, const char* key) {
  if (!command.contains(key)) Fail(fmt::format("has no \"{}\"", key));
  return command[key];
}

double Number(const Json& command, const char* key, double low, double high) {
  const Json& value = Member(command, key);
  if (!value.is_number() || !(value >= low && value <= high))
    Fail(fmt::format("\"{}\" must be a number from {} to {}", key, low, high));
  return value;
}

// As it would stand in a file.
std::string ValueText(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string AssignmentIn(const Json& command) {
  const Json& key = Member(command, "key");
  const Json& value = Member(command, "value");
  if (!key.is_string()) Fail("\"key\" must be text");
  if (value.is_object() || value.is_null()) Fail("\"value\" must be a value");
  return key.get<std::string>() + "=" + ValueText(value);
}

Eigen::Vector3d ForceIn(const Json& command) {
  const Json& list = Member(command, "force_newton");
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  const auto fail = [] {
    Fail(fmt::format("\"force_newton\" must be 3 numbers, together at most {} N",
                     kStrongestPush_newton));
  };
  if (!list.is_array() || list.size() != 3) fail();
  for (int i = 0; i < 3; ++i) {
    const Json& component = list[static_cast<size_t>(i)];
    if (!component.is_number()) fail();
    force[i] = component;
  }
  if (!(force.norm() <= kStrongestPush_newton)) fail();
  return force;
}

}  // namespace

std::vector<Control> ControlsOf(const trial::Scenario& settings) {
  const std::vector<std::string> off_on = {"false", "true"};
  std::vector<std::string> laws = NamesOf<control::Law>();
  for (const std::string& law : settings.plugins.controllers()) laws.push_back(law);
  std::vector<Control> controls = {
      {"water.milk_ml_m3", "milk", "water", "ml/m³", 0, 120},
      {"sea.current.surface_velocity_mps[0]", "current along", "sea", "m/s", -0.3, 0.3},
      {"sea.current.surface_velocity_mps[1]", "current across", "sea", "m/s", -0.3, 0.3},
      {"sea.current.gust_std_mps", "gusts", "sea", "m/s", 0, 0.1},
      {.key = "sea.state",
       .label = "swell",
       .group = "sea",
       .choices = NamesOf<vehicle::SeaState>()},
      {"sea.jonswap.significant_height_m", "irregular waves", "sea", "m", 0, 0.5},
      {.key = "lamps.enabled", .label = "lamps", .group = "light", .choices = off_on},
      {.key = "lamps.intensity_w_sr",
       .label = "lamps' intensity",
       .group = "light",
       .unit = "W/sr",
       .low = 0,
       .high = 0.2,
       .list_of = 3},
      {.key = "ball_lights.enabled",
       .label = "marker's own light",
       .group = "light",
       .choices = off_on},
      {.key = "controller", .label = "law", .group = "control", .choices = laws}};
  if (settings.plugins.controller().empty()) AddGains(settings.control.controller, &controls);
  return controls;
}

report::Json ControlsModel(const trial::Scenario& settings) {
  Json list = Json::array();
  for (const Control& control : ControlsOf(settings)) {
    const std::string first = control.list_of > 0 ? control.key + "[0]" : control.key;
    const std::string value = config::ValueOf(settings, first);
    Json entry = {{"key", control.key}, {"label", control.label}, {"group", control.group}};
    if (!control.choices.empty()) {
      entry["choices"] = control.choices;
      entry["value"] = value;
    } else {
      entry["unit"] = control.unit;
      entry["low"] = control.low;
      entry["high"] = control.high;
      entry["value"] = Json::parse(value);
    }
    if (control.list_of > 0) entry["list_of"] = control.list_of;
    list.push_back(entry);
  }
  return list;
}

LiveSession::LiveSession(const trial::Scenario& scenario, OnResult on_result)
    : on_result_(std::move(on_result)) {
  Restart(scenario);
}

LiveSession::~LiveSession() = default;

void LiveSession::Restart(const trial::Scenario& scenario) {
  auto next = std::make_unique<trial::RunningTrial>(scenario);
  Close();
  trial_ = std::move(next);
  result_.reset();
  began_ = settings_ = scenario;
  steps_left_ = 0;
  ++trial_number_;
  ++settings_number_;
}

void LiveSession::Handle(const std::string& command) {
  const Json json = report::ParseJson(command, "command");
  if (!json.is_object()) Fail("must be a JSON object");
  const Json& what = Member(json, "do");
  if (!what.is_string()) Fail("\"do\" must be text");
  const auto verb = what.get<std::string>();
  if (verb == "go") {
    going_ = true;
  } else if (verb == "pause") {
    going_ = false;
    steps_left_ = 0;
  } else if (verb == "step") {
    const double frames = json.contains("frames") ? Number(json, "frames", 1, kMostSteps) : 1;
    if (frames != std::floor(frames)) Fail("\"frames\" must be a whole number");
    going_ = false;
    steps_left_ = std::min(steps_left_ + static_cast<int>(frames), kMostSteps);
  } else if (verb == "speed") {
    speed_ = Number(json, "factor", kSlowest, kFastest);
  } else if (verb == "set") {
    const std::string assignment = AssignmentIn(json);
    trial::Scenario settings = trial::Changed(settings_, assignment);
    if (!result_) trial_->Set(assignment);
    settings_ = std::move(settings);
    ++settings_number_;
  } else if (verb == "push") {
    const Eigen::Vector3d force = ForceIn(json);
    if (!result_) trial_->Push(force);
  } else if (verb == "restart") {
    trial::Scenario scenario = settings_;
    if (json.contains("seed"))
      config::ApplySet("seed=" + ValueText(json["seed"]), &scenario, nullptr);
    Restart(scenario);
  } else {
    Fail("\"do\" must be one of go, pause, step, speed, set, push, restart");
  }
}

void LiveSession::Step(bool whole_images) {
  TD_CHECK(!result_, "a trial under way");
  trial_->SeeWhole(whole_images);
  trial_->Step();
  if (steps_left_ > 0) --steps_left_;
  if (trial_->ended()) TakeResult();
}

void LiveSession::Close() {
  if (trial_ && !result_ && !trial_->log().frames.empty()) TakeResult();
}

void LiveSession::TakeResult() {
  result_ = trial_->Finish();
  if (on_result_) on_result_(began_, *result_);
}

}  // namespace turbidock::live
