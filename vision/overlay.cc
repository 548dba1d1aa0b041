#include "vision/overlay.h"

#include <cmath>

namespace turbidock::vision {

std::vector<ProjectedBall> ProjectBalls(const MarkerParams& marker, const StereoRig& rig,
                                        StereoSide side, const Pose& X_HM) {
  const bool is_left = side == StereoSide::kLeft;
  const CameraIntrinsics& camera = is_left ? rig.left : rig.right;
  const Pose X_CM = (is_left ? rig.X_HL : rig.X_HR).Inverse() * X_HM;
  std::vector<ProjectedBall> projected;
  for (const BallParams& ball : marker.balls) {
    const Eigen::Vector3d p_CQ = X_CM * ball.p_MQ_m;
    if (p_CQ.z() < kNearestDepth_m) continue;
    const BallCircle circle = ProjectBall(camera, p_CQ, ball.radius_m);
    ProjectedBall out{{circle.u_px, circle.v_px}, circle.radius_px, {}};
    for (size_t i = 0; i < 3; ++i)
      out.rgb[i] = static_cast<uint8_t>(std::lround(255 * ball.display_rgb[i]));
    projected.push_back(out);
  }
  return projected;
}

std::vector<Eigen::Vector2d> DottedPoints(const MarkerParams& marker, const ProjectedBall& ball) {
  const SamplePoints samples(marker);
  std::vector<Eigen::Vector2d> points;
  points.reserve(kBallPoints);
  for (int i = 0; i < kBallPoints; ++i)
    points.push_back(ball.center_px + ball.radius_px * Eigen::Vector2d(samples.u[i], samples.v[i]));
  return points;
}

}  // namespace turbidock::vision
