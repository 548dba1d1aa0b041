// The estimator alone, on images of its own (here: black ones, with nothing to find).

#include <cstdio>

#include "sim/base/random.h"
#include "vision/rm_ga.h"

int main() {
  using namespace turbidock;
  vision::RmGa estimator({}, {}, {}, RigParams{}.MakeRig(), SeedTree(1).Stream("vision.rm_ga"));
  const StereoImage black{{Image3u8(640, 480), Image3u8(640, 480)}};
  const PoseEstimate& estimate = estimator.Update(black);
  std::printf("fitness %g after %lld evaluations\n", estimate.fitness,
              static_cast<long long>(estimate.evaluations));
  return estimate.fitness < -0.19 && estimate.evaluations > 0 ? 0 : 1;
}
