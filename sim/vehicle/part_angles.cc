#include "sim/vehicle/part_angles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <regex>
#include <sstream>
#include <vector>

#include "sim/base/check.h"
#include "sim/base/fields.h"
#include "sim/base/units.h"

namespace turbidock::vehicle {
namespace {

std::vector<double> NumbersIn(const std::string& text) {
  std::istringstream words(text);
  return std::vector<double>(std::istream_iterator<double>(words), {});
}

// The turn of a euler="..." or axisangle="..."; what is no turn stays, for MuJoCo to refuse.
std::string AsQuaternion(const std::string& key, const std::string& text, const Angles& angles) {
  const std::vector<double> n = NumbersIn(text);
  if (n.size() != (key == "euler" ? 3 : 4)) return key + "=\"" + text + "\"";
  const auto rad = [&](double angle) {
    return angles.in_degrees ? units::RadFromDeg(angle) : angle;
  };
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  if (key == "axisangle")
    q = Eigen::AngleAxisd(rad(n[3]), Eigen::Vector3d(n[0], n[1], n[2]).normalized());
  else
    for (size_t i = 0; i < 3; ++i) {
      const char axis = angles.eulerseq[i];  // a small letter turns with the body
      const Eigen::Quaterniond turn(
          Eigen::AngleAxisd(rad(n[i]), Eigen::Vector3d::Unit(std::tolower(axis) - 'x')));
      q = std::islower(axis) ? q * turn : turn * q;
    }
  return "quat=\"" + FormatNumber(q.w()) + " " + FormatNumber(q.x()) + " " + FormatNumber(q.y()) +
         " " + FormatNumber(q.z()) + "\"";
}

}  // namespace

void Angles::Read(const Tag& compiler, const std::string& where) {
  const std::string angle = compiler.attribute("angle"), seq = compiler.attribute("eulerseq");
  if (!angle.empty()) {
    in_degrees = angle == "degree";
    if (!in_degrees && angle != "radian")
      throw ConfigError(where + "<compiler angle=\"" + angle + "\">: must be degree or radian");
  }
  if (seq.empty()) return;
  eulerseq = seq;
  if (seq.size() != 3 || seq.find_first_not_of("xyzXYZ") != std::string::npos)
    throw ConfigError(where + "<compiler eulerseq=\"" + seq +
                      "\">: must be three of x, y, z, X, Y and Z");
}

std::string WithSceneAngles(const std::string& xml, const Angles& part) {
  if (part == Angles()) return xml;
  // Of any length, a value would take as deep a stack.
  static const std::regex kAttribute(
      R"re((\s)(euler|axisangle|angle|eulerseq)\s*=\s*(?:"([^"]{0,200})"|'([^']{0,200})'))re");
  std::string text;
  auto rest = xml.begin();
  for (std::sregex_iterator at(xml.begin(), xml.end(), kAttribute), end; at != end; ++at) {
    const std::string key = at->str(2);
    text.append(rest, (*at)[0].first).append(at->str(1));
    if (key == "euler" || key == "axisangle")
      text += AsQuaternion(key, at->str(3) + at->str(4), part);
    rest = (*at)[0].second;
  }
  return text.append(rest, xml.end());
}

void RequireTurns(const Tag& tag, const Angles& part, const std::string& where) {
  constexpr double kMostTurn_rad = 6.29;  // 2 pi, as people round it
  for (const char* key : {"euler", "axisangle"}) {
    const std::string text = tag.attribute(key);
    std::vector<double> angles = NumbersIn(text);
    if (std::string(key) == "axisangle" && angles.size() == 4) angles = {angles[3]};
    for (const double angle : angles)
      if (std::abs(part.in_degrees ? units::RadFromDeg(angle) : angle) > kMostTurn_rad)
        throw ConfigError(where + "<" + tag.name + " " + key + "=\"" + text +
                          "\">: is more than a turn: a part's angles are radians unless it says "
                          "<compiler angle=\"degree\"/>");
  }
}

}  // namespace turbidock::vehicle
