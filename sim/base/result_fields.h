#pragma once
// The fields (sim/base/fields.h) of a result whose keys are its members' own names, as they should
// be. A result is never set by hand, so there are no ranges and no descriptions:
//
//   struct LoopPoint {
//     double frequency_hz = 0, gain = 0, phase_rad = 0;
//     TURBIDOCK_FIELDS(frequency_hz, gain, phase_rad)
//   };

#include <algorithm>
#include <string>
#include <string_view>

#define TURBIDOCK_FIELDS(...)                                               \
  static void Fields(auto& self, auto&& field) { self.VisitFields(field); } \
  TURBIDOCK_VISIT_FIELDS(__VA_ARGS__)

// Where some keys differ: Fields names these, and the others by self.VisitFields(field).
#define TURBIDOCK_VISIT_FIELDS(...)                                                            \
  void VisitFields(auto& field) { ::turbidock::VisitNamed(#__VA_ARGS__, field, __VA_ARGS__); } \
  void VisitFields(auto& field) const { ::turbidock::VisitNamed(#__VA_ARGS__, field, __VA_ARGS__); }

namespace turbidock {

// Calls field(name, member) for each member; `names` has theirs, "a, b, c".
void VisitNamed(std::string_view names, auto& field, auto&... members) {
  const auto visit = [&](auto& member) {
    const std::string name(names.substr(0, names.find(',')));
    names.remove_prefix(std::min(names.size(), name.size() + 2));
    field(name.c_str(), member);
  };
  (visit(members), ...);
}

}  // namespace turbidock
