#pragma once
// Other optimisers on the same fitness, to compare with: pagmo's differential evolution, particle
// swarm and CMA-ES. As RM-GA they spend a fixed number of evaluations on a frame and begin the next
// one from the last population.

#include <memory>

#include "sim/base/camera.h"
#include "vision/gene.h"
#include "vision/hue_labels.h"
#include "vision/marker_model.h"
#include "vision/pose_estimator.h"

namespace turbidock::estimators {

enum class PagmoMethod { kDe, kPso, kCmaes };
constexpr auto Names(PagmoMethod) {
  using enum PagmoMethod;
  return EnumList<PagmoMethod>({{kDe, "de"}, {kPso, "pso"}, {kCmaes, "cmaes"}});
}

struct PagmoOptions {
  PagmoMethod method = PagmoMethod::kDe;
  int population = 60;
  int evaluations_per_frame = 540;  // a multiple of the population
  vision::SearchRange range;
};

std::unique_ptr<vision::PoseEstimator> MakePagmoEstimator(const PagmoOptions& options,
                                                          const vision::MarkerParams& marker,
                                                          const vision::HueParams& hue,
                                                          const StereoRig& rig, uint32_t seed);

}  // namespace turbidock::estimators
