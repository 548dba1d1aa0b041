#include "experiments/trial/resolution.h"

#include <algorithm>

#include "sim/base/check.h"

namespace turbidock::trial {

std::vector<std::string> ResolutionAssignments(const std::string& text) {
  const size_t times = std::min(text.find('x'), text.size());
  const std::string width = text.substr(0, times);
  const std::string height = times < text.size() ? text.substr(times + 1) : "";
  for (const std::string& number : {width, height})
    if (number.empty() || number.find_first_not_of("0123456789") != std::string::npos)
      throw ConfigError("--resolution " + text, "must be WIDTHxHEIGHT in pixels, such as 320x240");
  return {"rig.width_px=" + width, "rig.height_px=" + height};
}

}  // namespace turbidock::trial
