#include "experiments/report/quantity.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <regex>

namespace turbidock::report {
namespace {

struct Unit {
  const char* ending;
  const char* shown;
  double factor = 1;
};
constexpr double kDegrees = 180 / std::numbers::pi;
// The first that fits: longer endings before those that are a part of them.
constexpr std::array kUnits = {Unit{"_ml_m3", "ml/m³"}, Unit{"_rad_s", "°/s", kDegrees},
                               Unit{"_newton", "N"},    Unit{"_joule", "J"},
                               Unit{"_mps", "m/s"},     Unit{"_rad", "°", kDegrees},
                               Unit{"_deg", "°"},       Unit{"_mm", "mm"},
                               Unit{"_kg", "kg"},       Unit{"_m", "mm", 1000},
                               Unit{"_s", "s"},         Unit{"_v", "V"},
                               Unit{"_mps2", "m/s²"},   Unit{"_rad_s2", "°/s²", kDegrees},
                               Unit{"_mib", "MiB"},     Unit{"_bytes", "MB", 1e-6}};

}  // namespace

Quantity QuantityOf(const std::string& name) {
  for (const Unit& unit : kUnits) {
    const std::string ending = unit.ending;
    if (name.ends_with(ending) && name.find("_per_") == std::string::npos)
      return {Words(name.substr(0, name.size() - ending.size())), unit.shown, unit.factor};
  }
  return {Words(name), ""};
}

std::string Words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string Spoken(const std::string& sentence) {
  static const std::regex kShape(R"(\b(hull|pole|station|dock|ball|marker)_\w+)");
  return Words(std::regex_replace(sentence, kShape, "$1"));
}

std::string Digits(double value, int digits) { return fmt::format("{:.{}g}", value + 0.0, digits); }

std::string PValue(double p) {
  return p < 0.001 ? fmt::format("{:.1e}", p) : fmt::format("{:.3f}", p);
}

}  // namespace turbidock::report
