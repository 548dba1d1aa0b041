#include "experiments/studies/live/live_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "experiments/batch/summary.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/table.h"

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
  Eigen::Vector3d force = Eigen::Vector3d::Constant(std::nan(""));
  if (list.is_array() && list.size() == 3)
    for (int i = 0; i < 3; ++i)
      if (const Json& component = list[static_cast<size_t>(i)]; component.is_number())
        force[i] = component;
  if (!(force.norm() <= kStrongestPush_newton))
    Fail(fmt::format("\"force_newton\" must be 3 numbers, together at most {} N",
                     kStrongestPush_newton));
  return force;
}

// Collects what the page offers to change.
struct Controls {
  const trial::Scenario& settings;
  Json list = Json::array();

  Json& Add(const char* group, const std::string& key, const std::string& label) {
    list.push_back({{"key", key}, {"label", label}, {"group", group}});
    return list.back();
  }
  void Slide(const char* group, const std::string& key, const std::string& label, const char* unit,
             double low, double high) {
    const Json value = Json::parse(config::ValueOf(settings, key));
    Json& control = Add(group, key, label);
    control.update({{"unit", unit}, {"low", low}, {"high", high}, {"value", value}});
    if (!value.is_array()) return;
    // a lamp's channels are shown as the first and set to equal ones
    control["value"] = value[0];
    control["list_of"] = value.size();
  }
  void Choose(const char* group, const std::string& key, const std::string& label,
              const std::vector<std::string>& choices) {
    Add(group, key, label)
        .update({{"choices", choices}, {"value", config::ValueOf(settings, key)}});
  }
};

// Whether a key may have this value while a trial runs.
template <class V>
bool IsAllowed(const trial::Scenario& settings, const std::string& key, const V& value) {
  try {
    static_cast<void>(trial::Changed(settings, fmt::format("{}={}", key, value)));
    return true;
  } catch (const ConfigError&) {
    return false;
  }
}

}  // namespace

report::Json ControlsModel(const trial::Scenario& settings) {
  const std::vector<std::string> off_on = {"false", "true"};
  std::vector<std::string> controllers = settings.plugins.controllers();
  std::erase_if(controllers,
                [&](const auto& name) { return !IsAllowed(settings, "control.use", name); });
  Controls controls{settings};
  controls.Slide("water", "water.milk_ml_m3", "milk", "ml/m³", 0, 120);
  for (const auto& [axis, label] : {std::pair{"[0]", "current along"}, {"[1]", "current across"}})
    controls.Slide("sea", std::string("sea.current.surface_velocity_mps") + axis, label, "m/s",
                   -0.3, 0.3);
  controls.Slide("sea", "sea.current.gust_std_mps", "gusts", "m/s", 0, 0.1);
  controls.Choose("sea", "sea.state", "swell", NamesOf<vehicle::SeaState>());
  controls.Slide("sea", "sea.jonswap.significant_height_m", "irregular waves", "m", 0, 0.5);
  controls.Choose("light", "lights.lamps.enabled", "lamps", off_on);
  controls.Slide("light", "lights.lamps.intensity_w_sr", "lamps' intensity", "W/sr", 0, 0.2);
  controls.Choose("light", "lights.marker.enabled", "marker's own light", off_on);
  controls.Choose("control", "control.use", "controller", controllers);
  // the gains of the controller, from a tenth to four times what they are
  const std::string gains = "control." + settings.controller_name() + ".";
  for (const config::KeyDoc& doc : trial::ScenarioKeys(settings.plugins)) {
    if (!doc.key.starts_with(gains) || !report::NumberIn(doc.value)) continue;
    const double gain = Json::parse(config::ValueOf(settings, doc.key));
    if (gain > 0 && IsAllowed(settings, doc.key, 0.1 * gain) &&
        IsAllowed(settings, doc.key, 4 * gain)) {
      const report::Quantity name = batch::NameOfKey(doc.key.substr(gains.size()));
      controls.Slide("control", doc.key, name.label, name.unit.c_str(), 0.1 * gain, 4 * gain);
      controls.list.back()["factor"] = name.factor;
    }
  }
  return controls.list;
}

LiveSession::LiveSession(const trial::Scenario& scenario, OnResult on_result)
    : on_result_(std::move(on_result)) {
  Restart(scenario);
}

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

void LiveSession::FailIfEnded() const {
  if (result_) Fail("the trial has ended; restart it to step or push");
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
    FailIfEnded();
    going_ = false;
    steps_left_ = std::min(steps_left_ + 1, kMostSteps);
  } else if (verb == "speed") {
    speed_ = Number(json, "factor", kSlowest, kFastest);
  } else if (verb == "set") {
    const std::string assignment = AssignmentIn(json);
    trial::Scenario settings = trial::Changed(settings_, assignment);
    if (!result_) trial_->Set(assignment);
    settings_ = std::move(settings);
    ++settings_number_;
  } else if (verb == "push") {
    FailIfEnded();
    trial_->Push(ForceIn(json));
  } else if (verb == "restart") {
    trial::Scenario scenario = settings_;
    if (json.contains("seed"))
      trial::Resolve({config::ParseAssignment("trial.seed=" + ValueText(json["seed"]))}, &scenario);
    Restart(scenario);
  } else {
    Fail("\"do\" must be one of go, pause, step, speed, set, push, restart");
  }
}

void LiveSession::Step(bool whole_images) {
  TD_CHECK(!result_, "a trial under way");
  trial_->SetFullFrame(whole_images);
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
