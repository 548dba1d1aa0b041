#include "tests/support/awkward.h"

#include <numbers>

namespace turbidock::testing {

std::vector<Pose> AwkwardPoses() {
  using Eigen::AngleAxisd;
  using Eigen::Quaterniond;
  using Eigen::Vector3d;
  const std::vector<Quaterniond> rotations = {
      Quaterniond::Identity(),
      Quaterniond(-1, 0, 0, 0),
      Quaterniond(AngleAxisd(std::numbers::pi, Vector3d::UnitX())),
      Quaterniond(AngleAxisd(std::numbers::pi, Vector3d(1, 1, 1).normalized())),
      Quaterniond(AngleAxisd(1e-9, Vector3d::UnitZ())),
      Quaterniond(AngleAxisd(0.3, Vector3d(1, -2, 3).normalized())),
      Quaterniond(AngleAxisd(-2.9, Vector3d(-1, 0.1, 0).normalized())),
  };
  const std::vector<Vector3d> translations = {
      {0, 0, 0}, {1e-10, -1e-10, 0}, {0.35, -0.04, 0.067}, {1000, -1000, 1}};
  std::vector<Pose> poses;
  for (const auto& q : rotations)
    for (const auto& p : translations) poses.push_back({q, p});
  const size_t simple = poses.size();
  for (size_t i = 0; i < simple; i += 3)
    for (size_t j = 1; j < simple; j += 5) poses.push_back(poses[i] * poses[j]);
  return poses;
}

}  // namespace turbidock::testing
