#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "experiments/studies/recognition/recognition.h"
#include "sim/base/random.h"
#include "vision/fitness.h"
#include "vision/hue_labels.h"

namespace turbidock::recognition {
namespace {

// What is looked at of the images: a ball about the marker that holds its balls and this margin.
constexpr double kMargin_m = 0.05;

StereoRegion RegionOf(const trial::FixedView& view, const vision::MarkerParams& marker) {
  double reach_m = 0;
  for (const vision::BallParams& ball : marker.balls)
    reach_m = std::max(reach_m, ball.p_MQ_m.norm() + ball.radius_m + kMargin_m);
  return view.rig.Each([&](const MountedCamera& camera) {
    const auto [u, v, reach_px] =
        vision::ProjectBall(camera, camera.X_HC.Inverse() * view.X_HM.p, reach_m);
    return PixelRegion{std::max(0, static_cast<int>(u - reach_px)),
                       std::max(0, static_cast<int>(v - reach_px)),
                       std::min(camera.width_px, static_cast<int>(u + reach_px)),
                       std::min(camera.height_px, static_cast<int>(v + reach_px))};
  });
}

// The true pose, some within a few pixels of it, and many within the size of the marker.
std::vector<Pose> PosesAbout(const Pose& X_HM, double focal_px, Rng rng) {
  const double distance_m = X_HM.p.x(), px_m = distance_m / focal_px;
  const struct {
    int count;
    double across_m, along_m, eps;
  } clouds[] = {{150, px_m, 0.004, 0.01},
                {120, 2 * px_m, 0.01, 0.03},
                {300, 20 * px_m, 0.08 * distance_m, 0.06}};
  std::vector<Pose> poses = {X_HM};
  for (const auto& cloud : clouds)
    for (int i = 0; i < cloud.count; ++i) {
      const auto draw = [&](double deviation) { return deviation * rng.Normal(); };
      // in braces, for the order of arguments in parentheses is the compiler's
      const Eigen::Vector3d offset{draw(cloud.along_m), draw(cloud.across_m), draw(cloud.across_m)};
      const Eigen::Vector3d eps{draw(cloud.eps), draw(cloud.eps), draw(cloud.eps)};
      const Eigen::Quaterniond turn(std::sqrt(std::max(0.0, 1 - eps.squaredNorm())), eps.x(),
                                    eps.y(), eps.z());
      poses.push_back({X_HM.q * turn.normalized(), X_HM.p + offset});
    }
  return poses;
}

}  // namespace

CellResult RunNearTruth(const trial::FixedView& view, const trial::Scenario& scenario,
                        const RecognitionCell& cell, int frames) {
  const StereoRegion region = RegionOf(view, scenario.marker);
  const std::vector<Pose> X_HM =
      PosesAbout(view.X_HM, view.rig.left.fx_px, SeedsOf(scenario, cell).Stream("near_truth"));
  camera::StereoCamera cameras = CamerasOf(view, scenario, cell);
  vision::HueLabeller labeller(scenario.hue, scenario.marker);
  Stereo<Image1u8> labels;
  StereoImage seen;
  std::vector<double> fitness(X_HM.size());
  std::vector<float> best_of_frames;
  for (int frame = 0; frame < frames; ++frame) {
    cameras.ExposeHeld(region, frame, &seen);
    for (const Side side : kSides) labeller.Label(seen[side], region[side], &labels[side]);
    vision::Fitness evaluation(scenario.marker, view.rig, labels);
    evaluation.Confine(region);
    evaluation.EvaluateAll(X_HM, fitness);
    best_of_frames.push_back(static_cast<float>(std::ranges::max(fitness)));
  }
  CellResult result{.cell = cell};
  SetFitness(std::move(best_of_frames), &result);
  return result;
}

}  // namespace turbidock::recognition
