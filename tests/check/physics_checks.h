#pragma once
// Does the plant move as physics says? Closed forms and an independent integration against the same
// code that runs the trials.

#include <string>
#include <vector>

namespace turbidock::check {

// How a measured number must stand to the expected one.
enum class Relation { kNear, kAtMost };

struct PhysicsCheck {
  std::string name;       // what was measured
  std::string reference;  // where the expected value comes from, or what went wrong
  std::string unit;       // of the three numbers, empty for a ratio
  double measured = 0;
  Relation relation = Relation::kNear;
  double expected = 0;
  double tolerance = 0;  // for kNear, absolute

  bool pass() const;  // false when the measurement is not a number
};

// All checks of the dynamics, in a few seconds and with the same result every time. A case in which
// the plant fails gives one failed check that says so.
std::vector<PhysicsCheck> RunPhysicsChecks();

}  // namespace turbidock::check
