#include "experiments/config/rig_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "experiments/config/calibration_file.h"
#include "experiments/config/yaml_fields.h"

namespace turbidock::config {
namespace {

// Where the files do not say of which size the images were, the principal point tells it.
void RequireSameScale(const CalibratedCamera& camera, const ImageSize& images) {
  constexpr double kMost = 0.06;  // off the middle, of the image's size
  const double u = camera.K(0, 2) / images.width_px, v = camera.K(1, 2) / images.height_px;
  if (camera.size || std::max(std::abs(u - 0.5), std::abs(v - 0.5)) <= kMost) return;
  camera.at.Fail(fmt::format(
      "the principal point ({:.0f}, {:.0f}) is not near the middle of the images, {} x {}, as if "
      "of images {:.2g} times as large; give such images, or say in the file which image_width "
      "and image_height were calibrated",
      camera.K(0, 2), camera.K(1, 2), images.width_px, images.height_px, u + v));
}

CameraIntrinsics IntrinsicsOf(const CalibratedCamera& from, const ImageSize& images) {
  RequireSameScale(from, images);
  const ImageSize size = from.size.value_or(images);
  CameraIntrinsics camera{size.width_px, size.height_px, from.K(0, 0),
                          from.K(1, 1),  from.K(0, 2),   from.K(1, 2)};
  if (!(camera.fx_px > 0 && camera.fy_px > 0))
    from.at.Fail("the focal lengths of a camera matrix must be > 0");
  if (from.K(0, 1) != 0) from.at.Fail("a camera matrix with skew is not supported");
  RigParams own;  // sees as much as a rig of ours may
  for (const double focal_px : {camera.fx_px, camera.fy_px}) {
    own.horizontal_fov_rad = 2 * std::atan(camera.width_px / (2 * focal_px));
    try {
      CheckFields(own, "");
    } catch (const ConfigError& error) {
      from.at.Fail(
          fmt::format("a focal length of {} pixels: {}", FormatNumber(focal_px), error.what()));
    }
  }
  if (!InRange(0, camera.width_px).Contains(camera.cx_px) ||
      !InRange(0, camera.height_px).Contains(camera.cy_px))
    from.at.Fail(fmt::format("the principal point ({}, {}) is not in an image of {} x {}",
                             FormatNumber(camera.cx_px), FormatNumber(camera.cy_px),
                             camera.width_px, camera.height_px));
  return camera;
}

RigFromFile RigOf(const Calibration& calibration, const ImageSize& images) {
  const std::string& where = calibration.files;
  const Eigen::Matrix3d& R_RL = calibration.R_RL;
  if (!((R_RL * R_RL.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3) ||
      R_RL.determinant() < 0)
    throw ConfigError(where + ": R: is no rotation");
  const double baseline_m = calibration.p_RL.norm();
  if (!(baseline_m >= 0.005 && baseline_m <= 5))
    throw ConfigError(where + ": T: the baseline is " + FormatNumber(baseline_m) +
                      " m, must be in [0.005, 5]; T must be in metres");

  // All of it first in the left camera's frame L.
  const Eigen::Matrix3d R_LR = R_RL.transpose();
  const Eigen::Vector3d p_LR = -R_LR * calibration.p_RL;
  if (p_LR.x() < -0.5 * baseline_m)
    throw ConfigError(where +
                      ": T: the right camera is on the left of the left one; exchange the "
                      "cameras, or give as T where the left one is in the right one's frame");
  if (R_LR(2, 2) <= 0) throw ConfigError(where + ": R: the cameras look more than 90° apart");
  const bool is_level = p_LR.x() > std::sqrt(0.5) * baseline_m;
  const Eigen::Vector3d axes = Eigen::Vector3d::UnitZ() + R_LR.col(2);
  const Eigen::Vector3d left_of_head =
      is_level ? Eigen::Vector3d(-p_LR.normalized()) : -Eigen::Vector3d::UnitX();
  const Eigen::Vector3d ahead = (axes - axes.dot(left_of_head) * left_of_head).normalized();
  Eigen::Matrix3d R_LH;
  R_LH << ahead, left_of_head, ahead.cross(left_of_head);
  const Pose X_LH{Eigen::Quaterniond(R_LH).normalized(), 0.5 * p_LR};
  const Pose X_LR{Eigen::Quaterniond(R_LR).normalized(), p_LR};
  const Stereo<CalibratedCamera>& from = calibration.cameras;
  return {.rig = {{IntrinsicsOf(from.left, images), X_LH.Inverse()},
                  {IntrinsicsOf(from.right, images), X_LH.Inverse() * X_LR}},
          .distortion = {from.left.lens, from.right.lens}};
}

}  // namespace

RigFromFile LoadRig(const std::vector<std::string>& files, int image_width_px,
                    int image_height_px) {
  if (const std::optional<Calibration> calibration = ReadCalibration(files))
    return RigOf(*calibration, {image_width_px, image_height_px});
  const auto rig = LoadLayers<RigParams>(files, {});
  std::vector<YamlNode> nodes;
  for (const std::string& file : files) nodes.push_back(LoadYaml(file));
  for (const KeyDoc& doc : ListKeys<RigParams>())
    if (std::ranges::none_of(nodes,
                             [&](const YamlNode& node) { return node.Find(doc.key).has_value(); }))
      throw ConfigError(fmt::format("{}: {}: this key is required", files[0], doc.key));
  return {.rig = rig.MakeRig(), .distortion = {}};
}

}  // namespace turbidock::config
