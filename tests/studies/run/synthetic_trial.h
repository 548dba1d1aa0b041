#pragma once
// A made-up docking and pictures of it, for what draws trials. No simulation behind it.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "experiments/trial/trial_record.h"
#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/base/random.h"
#include "vision/overlay.h"

namespace turbidock::testing {

// From 1.2 m and 0.2 m to the side to docked at 0.35 m in `seconds`, 30 frames a second: detected
// at 15 %, docking from 45 %, thrown back to servoing between 55 % and 65 %, docked at 95 % of the
// time.
inline trial::TrialLog SyntheticTrial(double seconds) {
  using control::Stage;
  trial::TrialLog log;
  Rng rng = SeedTree(7).Stream("synthetic_trial");
  const auto frames = static_cast<int64_t>(std::lround(30 * seconds));
  double sway_m = 0, x_m = 1.2;
  for (int64_t k = 0; k < frames; ++k) {
    trial::FrameRecord f;
    f.frame = k;
    f.time_s = static_cast<double>(k) / 30;
    const double s = static_cast<double>(k) / static_cast<double>(frames);
    f.stage = s < 0.15   ? Stage::kApproach
              : s < 0.45 ? Stage::kVisualServoing
              : s < 0.55 ? Stage::kDocking
              : s < 0.65 ? Stage::kVisualServoing
              : s < 0.95 ? Stage::kDocking
                         : Stage::kDocked;
    f.controlled = s >= 0.15;
    f.desired = {0.6, 0, 0, 0};
    if (f.stage == Stage::kDocking)
      f.desired.x_m = std::max(0.35, 0.6 - (s < 0.6 ? s - 0.45 : s - 0.65));
    if (f.stage == Stage::kDocked) f.desired.x_m = 0.35;
    const double target_m = f.controlled ? f.desired.x_m : 1.05;
    x_m += (target_m - x_m) * 3 / static_cast<double>(frames) * 10;
    sway_m = 0.985 * sway_m + 0.0022 * rng.Normal();
    const double bump_m = 0.07 * std::exp(-std::pow((s - 0.56) / 0.025, 2));
    const double settle = std::exp(-std::max(0.0, s - 0.12) / 0.07);
    f.true_X_HM.p = {x_m, 0.2 * settle * std::cos(20 * s) + sway_m + bump_m,
                     -0.14 * settle + 0.012 * std::sin(2 * std::numbers::pi * f.time_s / 3.1)};
    f.true_X_HM.q = FromYawPitchRoll(0.15 * settle + 0.5 * sway_m, 0, 0);
    f.image_time_s = f.time_s;
    f.true_at_image_X_HM = f.true_X_HM;
    const bool lost = (s > 0.04 && s < 0.12) || (s > 0.335 && s < 0.35);
    f.fitness = lost ? 0.08 + 0.05 * rng.Uniform()
                     : std::clamp(0.83 - 0.25 * (x_m - 0.4) + 0.03 * rng.Normal(), -0.2, 1.0);
    const double noise_m = lost ? 0.25 : 0.004 * x_m;
    f.est_X_HM = f.true_X_HM;
    f.est_X_HM.p +=
        Eigen::Vector3d(2 * noise_m * rng.Normal(), noise_m * rng.Normal(), noise_m * rng.Normal());
    f.est_X_HM.q = FromYawPitchRoll(YawOf(f.true_X_HM.q) + 0.01 * rng.Normal(), 0, 0);
    log.frames.push_back(f);
  }
  return log;
}

// The default marker's balls in one camera of the default rig.
inline std::vector<vision::ProjectedBall> SyntheticBalls(const Pose& X_HM, bool left) {
  const StereoRig rig = RigParams{}.MakeRig();
  const CameraIntrinsics& camera = left ? rig.left : rig.right;
  const Pose X_CM = (left ? rig.left.X_HC : rig.right.X_HC).Inverse() * X_HM;
  const std::array<std::pair<Eigen::Vector3d, std::array<uint8_t, 3>>, 3> balls = {
      {{{-0.07, 0, 0}, {26, 255, 26}},
       {{0, 0, 0.07}, {255, 26, 26}},
       {{0, -0.07, 0}, {51, 77, 255}}}};
  std::vector<vision::ProjectedBall> projected;
  for (const auto& [p_MQ, rgb] : balls) {
    const Eigen::Vector3d p_CQ = X_CM * p_MQ;
    if (p_CQ.z() > 0.01)
      projected.push_back({camera.Project(p_CQ), camera.fx_px * 0.02 / p_CQ.z(), rgb});
  }
  return projected;
}

// The balls as bright discs with halos over an even veil, with noise.
inline Image3u8 SyntheticImage(const std::vector<vision::ProjectedBall>& balls, double veil_dn,
                               Rng* rng) {
  Image3u8 image(640, 480);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      std::array<double, 3> dn = {veil_dn + 4, veil_dn + 6, veil_dn + 9};
      for (const vision::ProjectedBall& ball : balls) {
        const double r =
            std::hypot(u - ball.center_px.x(), v - ball.center_px.y()) / ball.radius_px;
        const double light = r < 1 ? 0.7 + 0.5 * std::exp(-9 * r * r) : 0.09 / (r * r);
        for (size_t c = 0; c < 3; ++c) dn[c] += light * ball.rgb[c];
      }
      const auto noise = static_cast<double>(rng->NextU32() >> 29) - 3.5;
      for (size_t c = 0; c < 3; ++c)
        image.at(u, v)[c] = static_cast<uint8_t>(std::clamp(dn[c] + noise, 0.0, 255.0));
    }
  }
  return image;
}

}  // namespace turbidock::testing
