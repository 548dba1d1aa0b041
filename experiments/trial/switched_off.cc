#include "experiments/trial/switched_off.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "experiments/config/yaml_fields.h"

namespace turbidock::trial {
namespace {

// Keys, or groups of them, that have no effect while `by` is as it is.
struct Switched {
  bool is_off;
  std::string by;
  std::vector<std::string> keys;
};

std::vector<std::string> AllBut(std::vector<std::string> names, const std::string& chosen,
                                const std::string& group) {
  std::erase(names, chosen);
  for (std::string& name : names) name.insert(0, group + ".");
  return names;
}

template <class Params>
std::vector<std::string> KeysOf(const std::string& group) {
  std::vector<std::string> keys;
  for (const config::KeyDoc& doc : config::ListKeys<Params>())
    keys.push_back(JoinKey(group, doc.key));
  return keys;
}

std::vector<Switched> AllSwitched(const Scenario& s, bool sees_images) {
  // once: every key of it is listed
  static const std::vector<std::string> navigation =
      KeysOf<vehicle::NavigationParams>("navigation");
  const bool is_true_pose = s.pose_source == PoseSource::kTruePose,
             is_blind = is_true_pose && !sees_images;
  const bool is_by_hand = s.approach.mode == control::ApproachMode::kPilot;
  const light::LampParams& lamps = s.light.lamps;
  const std::string approach = "procedure.approach.";
  return {
      {is_blind,
       "estimator.pose_source",
       {"water", "lights", "cameras.optics", "cameras.sensor", "cameras.lens", "estimator.hue"}},
      {is_blind, "estimator.pose_source", AllBut(s.plugins.estimators(), "", "estimator")},
      {!is_true_pose, "estimator.pose_source", {"estimator.true_pose"}},
      {true, "estimator.use", AllBut(s.plugins.estimators(), s.estimator_name(), "estimator")},
      {true, "control.use", AllBut(s.plugins.controllers(), s.controller_name(), "control")},
      {s.estimator_name() == "fiducial", "estimator.use", {"estimator.hue"}},
      {s.light.water.milk_ml_m3 == 0,
       "water.milk_ml_m3",
       {"water.scattering_scale", "water.milk_scattering_m2_ml", "water.milk_asymmetry"}},
      {s.procedure.cycles == 1, "procedure.cycles", {"procedure.stay_s"}},
      {s.procedure.blind_max_s == 0, "procedure.blind_max_s", {"procedure.blind_rate_mps"}},
      {!lamps.enabled, "lights.lamps.enabled", {"lights.lamps"}},
      {lamps.beam != light::BeamShape::kCosine,
       "lights.lamps.beam",
       {"lights.lamps.cosine_exponent"}},
      {lamps.beam != light::BeamShape::kCone,
       "lights.lamps.beam",
       {"lights.lamps.cone_half_angle_rad", "lights.lamps.cone_soft_rad"}},
      {!s.light.ball_lights.enabled, "lights.marker.enabled", {"lights.marker"}},
      {s.sensor.transfer != camera::TransferCurve::kPower,
       "cameras.sensor.transfer",
       {"cameras.sensor.power"}},
      {s.light.water.background != light::Background::kCustom,
       "water.background",
       {"water.absorption_per_m", "water.scattering_per_m", "water.asymmetry"}},
      {s.snow.particles_per_m3 == 0, "water.snow.particles_per_m3", {"water.snow"}},
      {!s.sea.tether.enabled, "sea.tether.enabled", {"sea.tether"}},
      {s.sea.jonswap.significant_height_m == 0,
       "sea.jonswap.significant_height_m",
       {"sea.jonswap"}},
      {!s.levelling.enabled, "control.levelling.enabled", {"control.levelling"}},
      {s.start.placed(),
       "start.position_m",
       {"start.distance_min_m", "start.distance_max_m", "start.lateral_m", "start.vertical_m",
        "start.heading_rad", "start.roll_rad", "start.pitch_rad"}},
      {!s.approach.on(), approach + "mode", {"procedure.approach"}},
      {!s.approach.on(), approach + "mode", navigation},
      {!is_by_hand,
       approach + "mode",
       {approach + "hand_interval_s", approach + "hand_delay_s", approach + "hand_step_share"}},
  };
}

std::string ByWhat(const std::vector<Switched>& all, const Scenario& scenario,
                   const std::string& key) {
  const auto is_in = [&key](const std::string& group) {
    return key == group || key.starts_with(group + ".") || key.starts_with(group + "[");
  };
  for (const Switched& each : all)
    if (each.is_off && each.by != key && !each.by.starts_with(key + ".") &&
        std::ranges::any_of(each.keys, is_in))
      return each.by + " = " + config::TextOf(scenario, each.by);
  return "";
}

}  // namespace

std::string SwitchedOffBy(const Scenario& scenario, const std::string& key) {
  return ByWhat(AllSwitched(scenario, /*sees_images=*/false), scenario, key);
}

void IdleKeys::Look(const Scenario& scenario) {
  if (scenario.given.named.empty()) return;
  const std::vector<Switched> all = AllSwitched(scenario, sees_images_);
  for (const std::string& key : scenario.given.named) {
    if (on_.contains(key)) continue;
    if (const std::string by = ByWhat(all, scenario, key); by.empty())
      on_.insert(key);
    else
      off_.emplace(key, by);
  }
}

std::vector<std::string> IdleKeys::Remarks() const {
  std::vector<std::string> remarks;
  for (const auto& [key, by] : off_)
    if (!on_.contains(key)) remarks.push_back(fmt::format("{} changes no trial: {}", key, by));
  return remarks;
}

std::vector<std::string> RemarksOn(const Scenario& scenario) {
  IdleKeys idle;
  idle.Look(scenario);
  std::vector<std::string> remarks = scenario.given.remarks;
  std::ranges::move(idle.Remarks(), std::back_inserter(remarks));
  return remarks;
}

}  // namespace turbidock::trial
