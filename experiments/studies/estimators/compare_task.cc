#include "experiments/studies/estimators/compare_task.h"

#include <algorithm>
#include <cmath>

#include "vision/gene.h"
#include "vision/marker_model.h"

namespace turbidock::estimators {
namespace {

// Halves of the poses' ranges about a distance: of yaw, and of pitch and roll.
constexpr double kYaw_rad = 0.15, kPitch_rad = 0.1;

Pose DrawAboutDistance(double distance_m, Rng* rng) {
  const auto within = [&](double half) { return rng->Uniform(-half, half); };
  const double x_m = distance_m * (1 + within(0.05));
  const double side_m = std::max(0.0, 0.4 * x_m - 0.12);
  // in braces, for the order of arguments in parentheses is the compiler's
  const Eigen::Vector3d yaw_pitch_roll{within(kYaw_rad), within(kPitch_rad), within(kPitch_rad)};
  return {FromYawPitchRoll(yaw_pitch_roll[0], yaw_pitch_roll[1], yaw_pitch_roll[2]),
          {x_m, within(side_m), within(0.75 * side_m)}};
}

Pose DrawInRange(const vision::SearchRange& range, Rng* rng) {
  const vision::GeneMap map(range);
  vision::GeneMap::Values values;
  for (size_t i = 0; i < values.size(); ++i) values[i] = rng->Uniform(map.low()[i], map.high()[i]);
  return vision::GeneMap::PoseOf(values);
}

// Of the six projections of three balls: how many centres are in the image, and how many circles
// reach into it.
struct BallsSeen {
  int projections = 0, centres = 0, touching = 0;
};

BallsSeen CountBalls(const vision::MarkerParams& marker, const StereoRig& rig, const Pose& X_HM) {
  BallsSeen seen;
  for (const MountedCamera& camera : {rig.left, rig.right})
    for (const vision::BallParams& ball : marker.balls) {
      ++seen.projections;
      const Eigen::Vector3d p_CQ = camera.X_HC.Inverse() * (X_HM * ball.p_MQ_m);
      if (p_CQ.z() < vision::kNearestDepth_m) continue;
      const vision::BallCircle circle = vision::ProjectBall(camera, p_CQ, ball.radius_m);
      const auto within = [&circle, &camera](double margin_px) {
        return circle.u_px >= -margin_px && circle.u_px <= camera.width_px - 1 + margin_px &&
               circle.v_px >= -margin_px && circle.v_px <= camera.height_px - 1 + margin_px;
      };
      seen.centres += within(0);
      seen.touching += within(1.1 * circle.radius_px + 2);
    }
  return seen;
}

// A triangle wave between -1 and 1 with slope +-1, from 0 upwards.
double Triangle(double t) {
  const double phase = t + 1 - 4 * std::floor((t + 1) / 4);
  return phase < 2 ? phase - 1 : 3 - phase;
}

Eigen::Vector3d DrawDirection(Rng* rng) {
  return Eigen::Vector3d{rng->Normal(), rng->Normal(), rng->Normal()}.normalized();
}

// To and fro along a line and about an axis, in one direction for a second and for 0.7 s.
std::vector<Pose> DrawMotion(double distance_m, int frames, const trial::Scenario& scenario,
                             const StereoRig& rig, Rng* rng) {
  constexpr double kReach_m = 0.5 * kMovingSpeed_m_s, kTurn_rad = 0.35 * kMovingTurn_rad_s;
  for (;;) {
    const Eigen::Vector3d along = DrawDirection(rng), axis = DrawDirection(rng);
    const double x_m = distance_m * (1 + rng->Uniform(-0.05, 0.05));
    std::vector<Pose> path;
    for (int frame = 0; frame < frames; ++frame) {
      const double time_s = scenario.clock.TimeOfFrame(frame);
      const Eigen::Vector3d p_m = kReach_m * Triangle(time_s * kMovingSpeed_m_s / kReach_m) * along;
      const double turn_rad = kTurn_rad * Triangle(time_s * kMovingTurn_rad_s / kTurn_rad);
      path.push_back({Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, axis)),
                      Eigen::Vector3d(x_m, 0, 0) + p_m});
    }
    if (std::ranges::all_of(path, [&](const Pose& X_HM) {
          const BallsSeen seen = CountBalls(scenario.marker, rig, X_HM);
          return seen.centres == seen.projections;
        }))
      return path;
  }
}

}  // namespace

std::vector<Pose> DrawStart(CompareTask task, double distance_m, int frames,
                            const trial::Scenario& scenario, const StereoRig& rig, Rng* rng) {
  switch (task) {
    case CompareTask::kStill:
      return {DrawAboutDistance(distance_m, rng)};
    case CompareTask::kMoving:
      return DrawMotion(distance_m, frames, scenario, rig, rng);
    case CompareTask::kAnywhere:
      // F >= 0.6 needs two thirds of the projections.
      for (;;) {
        const Pose X_HM = DrawInRange(scenario.estimator.range, rng);
        const BallsSeen seen = CountBalls(scenario.marker, rig, X_HM);
        if (3 * seen.centres >= 2 * seen.projections) return {X_HM};
      }
    case CompareTask::kAbsent:
      // To the side, above, below or behind.
      for (;;) {
        const Pose X_HM = {
            FromYawPitchRoll(rng->Uniform(-0.5, 0.5), 0, 0),
            {rng->Uniform(-1, 1.6), rng->Uniform(-1.2, 1.2), rng->Uniform(-0.9, 0.9)}};
        if (X_HM.p.norm() > 0.4 && CountBalls(scenario.marker, rig, X_HM).touching == 0)
          return {X_HM};
      }
  }
  return {};
}

}  // namespace turbidock::estimators
