#pragma once
// What all faults have in common: a time at which they begin, and one at which they are over.
//
// A fault is a value type in the module whose work it spoils, with FaultSpan as its base; the
// groups of `faults` in a scenario are lists of them (experiments/trial/faults.h).

#include <string>

#include "sim/base/fields.h"
#include "sim/base/stereo.h"

namespace turbidock {

// From begin_s on, before end_s, in the trial's time. Images count by when they were exposed; those
// that were before a trial begins are of its time 0.
struct FaultSpan {
  static constexpr double kLongest_s = 86400;  // as long as a trial may be

  double begin_s = 0, end_s = kLongest_s;

  bool Holds(double time_s) const { return begin_s <= time_s && time_s < end_s; }

  static void Fields(auto& self, auto&& field) {
    field("begin_s", self.begin_s, InRange(0, kLongest_s),
          "time in the trial at which the fault begins");
    field("end_s", self.end_s, InRange(0, kLongest_s), "time in the trial at which the fault ends");
  }
  void Check(const std::string& path) const {
    if (end_s <= begin_s)
      throw ConfigError(JoinKey(path, "end_s"), FormatNumber(end_s) + " must be after begin_s (" +
                                                    FormatNumber(begin_s) + ")");
  }
};

// Which of the two cameras has a fault.
enum class FaultyCamera { kLeft, kRight, kBoth };
constexpr auto Names(FaultyCamera) {
  using enum FaultyCamera;
  return EnumList<FaultyCamera>({{kLeft, "left"}, {kRight, "right"}, {kBoth, "both"}});
}
inline bool Has(FaultyCamera faulty, Side side) {
  return faulty == FaultyCamera::kBoth || (faulty == FaultyCamera::kLeft) == (side == Side::kLeft);
}

}  // namespace turbidock
