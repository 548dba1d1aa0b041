#include "experiments/trial/resolution.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::trial {

Resolution ParseResolution(const std::string& text) {
  const auto number = [](const char* begin, const char* end, int* value) {
    const auto [stop, error] = std::from_chars(begin, end, *value);
    return error == std::errc() && stop == end;
  };
  const char* const begin = text.data();
  const char* const end = begin + text.size();
  const char* const times = std::find(begin, end, 'x');
  Resolution resolution;
  if (times == end || !number(begin, times, &resolution.width_px) ||
      !number(times + 1, end, &resolution.height_px))
    throw ConfigError("--resolution " + text, "must be WIDTHxHEIGHT in pixels, such as 320x240");
  return resolution;
}

void SetResolution(const Resolution& resolution, Scenario* scenario) {
  RigParams& rig = scenario->rig;
  const double pixels_before = static_cast<double>(rig.width_px) * rig.height_px;
  rig.width_px = resolution.width_px;
  rig.height_px = resolution.height_px;
  CheckFields(rig, "rig");
  const double ratio = static_cast<double>(rig.width_px) * rig.height_px / pixels_before;
  int& own_chroma_pixels = scenario->hue.own_chroma_pixels;
  own_chroma_pixels = std::max(1, static_cast<int>(std::lround(ratio * own_chroma_pixels)));
}

}  // namespace turbidock::trial
