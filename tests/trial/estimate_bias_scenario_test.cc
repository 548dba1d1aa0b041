// How far estimates are off on average in a trial: what assets/measured/estimator.md tells of the
// published camera, which no covariance says.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "experiments/statistics/intervals.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/base/units.h"

namespace turbidock::trial {
namespace {

// Median over the frames with a reliable estimate, along the camera head's x, less the truth of the
// image.
double BiasAhead_mm(const std::string& scenario, const std::string& optics) {
  const TrialResult result = RunTrial(LoadScenario(
      scenario,
      std::vector<std::string>{"cameras.optics=" + optics, "trial.seed=1", "trial.duration_s=4",
                               "start.distance_min_m=0.6", "start.distance_max_m=0.75"}));
  std::vector<double> off_mm;
  for (const FrameRecord& frame : result.log.frames)
    if (frame.fitness >= 0.6)
      off_mm.push_back(units::MmFromM(frame.est_X_HM.p.x() - frame.true_at_image_X_HM.p.x()));
  EXPECT_GT(off_mm.size(), 60u) << scenario << ", " << optics;
  return statistics::Median(off_mm).value_or(0);
}

TEST(EstimateBias, OfThePassiveMarkerIsThePublishedCameras) {
  EXPECT_NEAR(BiasAhead_mm("pool_passive", "published"), -6.3, 1);
  EXPECT_NEAR(BiasAhead_mm("pool_passive", "modern_digital"), -1.2, 1);
  EXPECT_NEAR(BiasAhead_mm("pool_active", "published"), 0, 1);
}

}  // namespace
}  // namespace turbidock::trial
