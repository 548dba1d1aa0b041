#pragma once
// Where the time of the closed loop goes, by stage. Whoever does a stage's work says when it is
// done; without a timer that costs the test of a pointer.

#include <array>
#include <chrono>
#include <cstddef>
#include <utility>

#include "sim/base/fields.h"

namespace turbidock {

// In the order of a frame.
enum class LoopStage {
  kRender,    // the list of things to draw, and drawing them
  kReadBack,  // from OpenGL's buffers to surface and depth
  kWater,
  kSensor,
  kLabels,    // which pixels have a ball's colour
  kEstimate,  // the search for the pose
  kControl,   // procedure, servo, allocation
  kPhysics,   // all ticks of the frame
  kLog,       // record, digest
};
constexpr auto Names(LoopStage) {
  using enum LoopStage;
  return EnumList<LoopStage>({{kRender, "render"},
                              {kReadBack, "read_back"},
                              {kWater, "water"},
                              {kSensor, "sensor"},
                              {kLabels, "labels"},
                              {kEstimate, "estimate"},
                              {kControl, "control"},
                              {kPhysics, "physics"},
                              {kLog, "log"}});
}

inline constexpr size_t kLoopStages = EnumNames<LoopStage>::kNames.size();

// A stopwatch with laps: the time since the last lap belongs to the stage that ends now, so nothing
// between two laps is lost and the stages add up to the whole.
class StageTimer {
 public:
  using Seconds = std::array<double, kLoopStages>;  // by LoopStage

  // What passed since the last lap belongs to no stage.
  void Skip() { last_ = Clock::now(); }
  void Lap(LoopStage stage) {
    const Clock::time_point now = Clock::now();
    seconds_[static_cast<size_t>(stage)] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }
  // The sums since the last call; begins anew.
  Seconds Take() { return std::exchange(seconds_, {}); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
  Seconds seconds_{};
};

// A stage is done, if anyone wants to know.
inline void Lap(StageTimer* timer, LoopStage stage) {
  if (timer != nullptr) timer->Lap(stage);
}

}  // namespace turbidock
