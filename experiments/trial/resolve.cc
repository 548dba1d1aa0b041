// Setting values in a scenario, with what its estimator knows from the scene.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/scene_marker.h"

namespace turbidock::trial {
namespace {

using config::Assignment;

// Beginnings of the keys that decide what is taken from the scene.
constexpr std::array kDecidesTaken = {"trial.scene",    "vehicle.model", "station.model",
                                      "cameras.optics", "lights.marker", "marker",
                                      "estimator.use"};

// What is known of the scene where nothing gives it: the marker's balls, and more by some
// estimators. It follows from the other keys alone. The bundled scenes have the default marker:
// there is no need to look.
void TakeFromScene(Scenario* scenario) {
  const bool takes_balls = scenario->marker_from_scene && !config::IsBundledModel(scenario->model);
  if (scenario->marker_from_scene) scenario->TakeDefaultBalls();
  for (const SceneHooks& hooks : scenario->plugins.all_scene_hooks())
    if (hooks.takes(*scenario)) hooks.take(nullptr, scenario);
  const SceneHooks hooks = scenario->plugins.scene_hooks();
  const bool takes_more = hooks.takes && hooks.takes(*scenario);
  if (takes_balls || takes_more) {
    const vehicle::Scene scene = vehicle::LoadScene(SceneFilesOf(*scenario), scenario->rig);
    if (takes_balls) TakeBalls(scene, scenario);
    if (takes_more) hooks.take(&scene, scenario);
  }
}

// What is taken from the scene while the flag says so. Giving a part says no, unless it is as it is
// there.
struct Taken {
  std::string flag;
  std::vector<std::string> parts;
};

std::vector<Taken> AllTaken(const Plugins& plugins) {
  std::vector<Taken> all = {{"marker.from_scene", {"marker.balls", "marker.box_m"}}};
  for (const SceneHooks& hooks : plugins.all_scene_hooks())
    all.push_back({hooks.flag, {hooks.part}});
  return all;
}

// The value that a layer gives a key, or an element of it.
std::optional<config::YamlNode> ValueIn(const Assignment& layer, const std::string& key) {
  if (!layer.key.empty() && layer.key.starts_with(key)) return layer.value;
  const std::string group = layer.key.empty() ? "" : layer.key + ".";
  if (!key.starts_with(group)) return std::nullopt;
  return layer.value.FindPath(key.substr(group.size()));
}

bool Says(const Scenario& scenario, const std::string& flag) {
  return config::ValueOf(scenario, flag) == "true";
}

void Allow(const std::string& flag, Scenario* scenario) {
  config::SetLayers({config::ParseAssignment(flag + "=true")}, scenario);
}

bool IsAsInScene(const Scenario& scenario, const Taken& what) {
  Scenario taken = scenario;
  Allow(what.flag, &taken);
  try {
    TakeFromScene(&taken);
  } catch (const ConfigError&) {  // such as balls that only a person can tell apart
    return false;
  }
  return std::ranges::all_of(what.parts, [&](const std::string& part) {
    return config::TextOf(taken, part) == config::TextOf(scenario, part);
  });
}

// Reads layers one after the other, and keeps what is taken from the scene up to date.
class Resolver {
 public:
  explicit Resolver(Scenario* scenario) : scenario_(scenario) {}

  void Read(const std::vector<Assignment>& layers) {
    if (layers.empty()) return;
    const config::Origins origins = config::SetLayers(layers, scenario_, &scenario_->given);
    const auto decides = [&origins](const std::string& key) {
      const auto there = origins.lower_bound(key);
      return there != origins.end() && there->first.starts_with(key);
    };
    is_stale_ = is_stale_ || std::ranges::any_of(kDecidesTaken, decides) ||
                decides("estimator." + scenario_->plugins.estimator() + ".");
  }

  // A layer that gives parts of what is taken: they are set in the rest of it.
  void ReadParts(const Assignment& layer, const std::vector<Taken>& given) {
    Take();
    std::vector<Taken> wanted;
    for (const Taken& what : given) {
      const auto said = ValueIn(layer, what.flag);
      if (said ? said->Text() == "true" : Says(*scenario_, what.flag)) wanted.push_back(what);
    }
    Read({layer});
    for (const Taken& what : wanted)
      if (!Says(*scenario_, what.flag) && IsAsInScene(*scenario_, what))
        Allow(what.flag, scenario_);
  }

  bool Take() {
    if (!is_stale_) return false;
    TakeFromScene(scenario_);
    return std::exchange(is_stale_, false);
  }

 private:
  Scenario* scenario_;
  bool is_stale_ = false;
};

}  // namespace

void Resolve(const std::vector<Assignment>& given, Scenario* scenario) {
  Scenario next = *scenario;
  Resolver resolver(&next);
  const std::vector<Taken> all = AllTaken(next.plugins);
  std::vector<Assignment> others;
  for (const Assignment& layer : given) {
    std::vector<Taken> parts;
    for (const Taken& what : all)
      if (std::ranges::any_of(what.parts,
                              [&](const auto& part) { return ValueIn(layer, part).has_value(); }))
        parts.push_back(what);
    if (parts.empty()) {
      others.push_back(layer);
      continue;
    }
    resolver.Read(std::exchange(others, {}));
    resolver.ReadParts(layer, parts);
  }
  resolver.Read(others);
  config::CheckSettings(next, next.given.origins);
  if (resolver.Take()) CheckFields(next, "");
  *scenario = std::move(next);
}

}  // namespace turbidock::trial
