#include "vision/overlay.h"

#include <cmath>

namespace turbidock::vision {

std::vector<ProjectedBall> ProjectBalls(const MarkerParams& marker, const MountedCamera& camera,
                                        const Pose& X_HM) {
  const Pose X_CM = camera.X_HC.Inverse() * X_HM;
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

}  // namespace turbidock::vision
