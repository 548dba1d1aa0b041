#pragma once
// Studies from their text: short trials without cameras.

#include <string>

#include "control/lqg.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/studies/tuning/study.h"
#include "tests/support/message_of.h"

namespace turbidock::tuning {

inline const std::string kTrials = R"(scenario: pool_active
seeds: 4
set: {estimator.pose_source: true_pose, control.use: lqg, trial.duration_s: 2.5,
      trial.after_docked_s: 0, estimator.true_pose.found_after_s: 0, procedure.found_hold_s: 0,
      control.lqg.sway.effort_share: 0.27, control.lqg.sway.error_m: 0.01,
      control.lqg.sway.current_mps2: 0.158, control.lqg.yaw.error_rad: 0.185,
      control.lqg.yaw.effort_share: 0.236, control.lqg.yaw.current_rad_s2: 1.22}
tuning:
)";
inline const control::LqgParams& LqgOf(const trial::Scenario& scenario) {
  return scenario.plugins.ParamsOf<control::LqgParams>();
}

inline const std::string kGains =
    "  gains: [{key: control.lqg.sway.effort_share, low: 0.2, high: 3, scale: log}]\n";
inline const std::string kObjective = "  objective: [{metric: tracking_rms_m, weight: 1000}]\n";
inline const std::string kHead = "schema_version: 1\ndescription: a test\n";
inline const std::string kStudy = kHead + kTrials + kGains + kObjective;
inline const std::string kFast =
    "  start_may_fail: true\n"
    "  optimiser: {population: 5, generations: 2}\n"
    "  racing: {first: 2, every: 1, confidence: 0.9}\n"
    "  proof: {held_out_seeds: 3, cameras: false}\n";

inline Study StudyOf(const std::string& text, const std::string& file = "study.yaml") {
  return Study(config::ParseYaml(text, file));
}

inline std::string MessageOf(const std::string& text) {
  return testing::MessageOf([&] { StudyOf(text); });
}

}  // namespace turbidock::tuning
