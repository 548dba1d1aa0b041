#include "vision/detection.h"

#include <algorithm>

namespace turbidock::vision {

void DetectionParams::Check(const std::string& path) const {
  if (off_fitness > on_fitness)
    throw ConfigError(path.empty() ? "off_fitness" : path + ".off_fitness",
                      FormatNumber(off_fitness) + ", must not exceed on_fitness (" +
                          FormatNumber(on_fitness) + ")");
}

void Detection::Update(double fitness, std::span<const double> ball_fitness, bool is_tracked) {
  const bool is_certain =
      fitness >= certain_.fitness &&
      (is_tracked || *std::ranges::min_element(ball_fitness) >= certain_.ball_fitness);
  frames_certain_ = is_certain ? frames_certain_ + 1 : 0;
  frames_uncertain_ = is_certain ? 0 : frames_uncertain_ + 1;
  frames_on_ = fitness >= limits_.on_fitness ? frames_on_ + 1 : 0;
  frames_off_ = fitness < limits_.off_fitness ? frames_off_ + 1 : 0;
  if (frames_on_ >= limits_.on_frames) detected_ = true;
  if (frames_off_ >= limits_.off_frames) detected_ = false;
}

}  // namespace turbidock::vision
