#pragma once
// Does the plant move as physics says? Closed forms and an independent integration against the same
// code that runs the trials; `turbidock selftest --physics` prints them.

#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/result_fields.h"

namespace turbidock::check {

// How a measured number must stand to the expected one.
enum class Relation { kNear, kAtMost, kAtLeast };
constexpr auto Names(Relation) {
  using enum Relation;
  return EnumList<Relation>({{kNear, "near"}, {kAtMost, "at_most"}, {kAtLeast, "at_least"}});
}

struct PhysicsCheck {
  std::string name;       // what was measured
  std::string reference;  // where the expected value comes from, or what went wrong
  std::string unit;       // of the three numbers, empty for a ratio
  double measured = 0;
  Relation relation = Relation::kNear;
  double expected = 0;
  double tolerance = 0;  // for kNear, absolute

  bool pass() const;  // false when the measurement is not a number

  TURBIDOCK_FIELDS(name, reference, unit, measured, relation, expected, tolerance)
};

// All checks of the dynamics, in a few seconds and with the same result every time. A case in which
// the plant fails gives one failed check that says so.
std::vector<PhysicsCheck> RunPhysicsChecks();

// What a tick of the closed loop's vehicle costs without cameras, in this scene: times
// real time, and in bare mj_steps of the same model. Timed, so it depends on the machine's load:
// both are run by turns, and the medians compared.
std::vector<PhysicsCheck> MeasurePhysicsCost(const std::string& scene_file);

}  // namespace turbidock::check
