#pragma once
// What the estimators under comparison look at: the marker at rest, moving, or not there.

#include <vector>

#include "experiments/trial/scenario.h"
#include "sim/base/camera.h"
#include "sim/base/fields.h"
#include "sim/base/pose.h"
#include "sim/base/random.h"

namespace turbidock::estimators {

enum class CompareTask {
  kStill,     // at rest about a distance, all balls in both images
  kAnywhere,  // at rest anywhere in the search range, as long as the image is Area I
  kMoving,    // about a distance, at constant speed to and fro
  kAbsent,    // no ball in either image; box, plate and halos may be
};
constexpr auto Names(CompareTask) {
  using enum CompareTask;
  return EnumList<CompareTask>(
      {{kStill, "still"}, {kAnywhere, "anywhere"}, {kMoving, "moving"}, {kAbsent, "absent"}});
}

// A marker that moves starts at once; estimates count from this frame on.
inline constexpr int kMovingSettleFrames = 30;
inline constexpr double kMovingSpeed_m_s = 0.2;
inline constexpr double kMovingTurn_rad_s = 0.349;  // 20 degrees

// Whether every start of the task has a distance of its own.
inline bool IsAboutDistance(CompareTask task) {
  return task == CompareTask::kStill || task == CompareTask::kMoving;
}

// The marker in the camera head at each frame of one start: one pose while it is at rest. For
// kAnywhere a candidate: that it is Area I has to be seen in the image.
std::vector<Pose> DrawStart(CompareTask task, double distance_m, int frames,
                            const trial::Scenario& scenario, const StereoRig& rig, Rng* rng);

}  // namespace turbidock::estimators
