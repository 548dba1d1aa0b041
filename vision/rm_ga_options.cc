#include "vision/rm_ga_options.h"

namespace turbidock::vision {

RmGaOptions RmGaOptions::Published() {
  RmGaOptions options;
  options.preset = Preset::kPublished;
  options.generations_per_frame = 9;
  options.immigrant_share = 0;
  options.creep_share = 0;
  options.restart_after_frames = 0;
  options.swing_rad = 0;
  options.track.enabled = false;
  options.refine.enabled = false;
  return options;
}

void RmGaOptions::Check(const std::string& path) const {
  const auto fail = [&](const std::string& key, const std::string& problem) {
    throw ConfigError(path.empty() ? key : path + "." + key, problem);
  };
  if (immigrant_share + creep_share > 1)
    fail("creep_share", FormatNumber(creep_share) + " with immigrant_share " +
                            FormatNumber(immigrant_share) + ", must not exceed 1 together");
  if (creep_min_m > creep_max_m)
    fail("creep_max_m", FormatNumber(creep_max_m) + ", must be >= creep_min_m");
  if (creep_min_m > creep_max_found_m)
    fail("creep_max_found_m", FormatNumber(creep_max_found_m) + ", must be >= creep_min_m");
}

}  // namespace turbidock::vision
