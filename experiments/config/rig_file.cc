#include "experiments/config/rig_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <opencv2/core.hpp>

#include "experiments/config/yaml_fields.h"

namespace turbidock::config {
namespace {

bool IsOpenCv(const std::string& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line.starts_with("%YAML:1.0") || line.starts_with("%YAML 1.0");
}

// The matrices of a calibration, whichever of the files holds them.
class Calibration {
 public:
  explicit Calibration(const std::vector<std::string>& files)
      : names_(fmt::format("{}", fmt::join(files, ", "))) {
    for (const std::string& file : files) {
      cv::FileStorage storage;
      try {
        storage.open(file, cv::FileStorage::READ);
      } catch (const cv::Exception& error) {
        throw ConfigError(file + ": is no calibration of OpenCV's: " + error.err);
      }
      if (!storage.isOpened()) throw ConfigError(file + ": cannot be read");
      storages_.push_back(std::move(storage));
    }
  }

  const std::string& names() const { return names_; }

  // The first of these names that is there.
  cv::FileNode Find(std::initializer_list<const char*> names) const {
    for (const char* name : names)
      for (const cv::FileStorage& storage : storages_)
        if (const cv::FileNode node = storage[name]; !node.empty()) return node;
    return {};
  }

  // Row by row. `sizes`: the numbers of elements that are allowed.
  std::vector<double> Matrix(std::initializer_list<const char*> names,
                             std::initializer_list<size_t> sizes) const {
    const cv::FileNode node = Find(names);
    if (node.empty()) throw ConfigError(names_ + ": " + *names.begin() + ": this key is required");
    cv::Mat matrix;
    try {
      node >> matrix;
      matrix.convertTo(matrix, CV_64F);
    } catch (const cv::Exception& error) {
      throw ConfigError(names_ + ": " + *names.begin() + ": is no matrix: " + error.err);
    }
    std::vector<double> values(matrix.begin<double>(), matrix.end<double>());
    if (std::ranges::find(sizes, values.size()) == sizes.end())
      throw ConfigError(fmt::format("{}: {}: has {} elements, must have {}", names_, *names.begin(),
                                    values.size(), fmt::join(sizes, " or ")));
    if (!std::ranges::all_of(values, [](double x) { return std::isfinite(x); }))
      throw ConfigError(names_ + ": " + *names.begin() + ": has an element that is no number");
    return values;
  }

 private:
  std::string names_;
  std::vector<cv::FileStorage> storages_;
};

CameraIntrinsics IntrinsicsOf(const std::vector<double>& matrix, const std::string& where,
                              int width_px, int height_px) {
  CameraIntrinsics camera{width_px, height_px, matrix[0], matrix[4], matrix[2], matrix[5]};
  if (!(camera.fx_px > 0 && camera.fy_px > 0))
    throw ConfigError(where + ": the focal lengths of a camera matrix must be > 0");
  if (matrix[1] != 0) throw ConfigError(where + ": a camera matrix with skew is not supported");
  return camera;
}

vision::LensDistortion DistortionOf(std::vector<double> d) {
  d.resize(8);
  return {d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7]};
}

RigFromFile RigOfCalibration(const Calibration& calibration, int width_px, int height_px) {
  const std::string& where = calibration.names();
  const cv::FileNode width = calibration.Find({"image_width"});
  const cv::FileNode height = calibration.Find({"image_height"});
  const cv::FileNode size = calibration.Find({"imageSize", "image_size", "size"});
  if (width.isInt() && height.isInt()) {
    width_px = static_cast<int>(width);
    height_px = static_cast<int>(height);
  } else if (size.isSeq() && size.size() == 2) {
    width_px = static_cast<int>(size[0]);
    height_px = static_cast<int>(size[1]);
  }

  RigFromFile out;
  const auto camera = [&](std::initializer_list<const char*> names) -> MountedCamera {
    return {IntrinsicsOf(calibration.Matrix(names, {9}), where, width_px, height_px), Pose()};
  };
  out.rig = {camera({"M1", "K1", "cameraMatrix1"}), camera({"M2", "K2", "cameraMatrix2"})};
  out.distortion = {DistortionOf(calibration.Matrix({"D1", "distCoeffs1"}, {4, 5, 8})),
                    DistortionOf(calibration.Matrix({"D2", "distCoeffs2"}, {4, 5, 8}))};

  const std::vector<double> R = calibration.Matrix({"R"}, {9}), T = calibration.Matrix({"T"}, {3});
  const Eigen::Matrix3d R_RL =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data());
  const Eigen::Vector3d p_RL = Eigen::Map<const Eigen::Vector3d>(T.data());
  if ((R_RL * R_RL.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-3 ||
      R_RL.determinant() < 0)
    throw ConfigError(where + ": R: is no rotation");
  const double baseline_m = p_RL.norm();
  if (!(baseline_m >= 0.005 && baseline_m <= 5))
    throw ConfigError(where + ": T: the baseline is " + FormatNumber(baseline_m) +
                      " m, must be in [0.005, 5]; T must be in metres");

  // All of it first in the left camera's frame L.
  const Eigen::Vector3d p_LR = -R_RL.transpose() * p_RL;
  const Eigen::Vector3d left_of_head = -p_LR.normalized();
  const Eigen::Vector3d axes = Eigen::Vector3d::UnitZ() + R_RL.transpose().col(2);
  const Eigen::Vector3d ahead = (axes - axes.dot(left_of_head) * left_of_head).normalized();
  if (!ahead.allFinite() || ahead.norm() < 0.5 || left_of_head.x() >= 0)
    throw ConfigError(where + ": T: the right camera must be on the right of the left one");
  Eigen::Matrix3d R_LH;
  R_LH << ahead, left_of_head, ahead.cross(left_of_head);
  const Pose X_LH{Eigen::Quaterniond(R_LH).normalized(), 0.5 * p_LR};
  const Pose X_LR{Eigen::Quaterniond(Eigen::Matrix3d(R_RL.transpose())).normalized(), p_LR};
  out.rig.left.X_HC = X_LH.Inverse();
  out.rig.right.X_HC = X_LH.Inverse() * X_LR;
  return out;
}

}  // namespace

RigFromFile LoadRig(const std::vector<std::string>& files, int image_width_px,
                    int image_height_px) {
  if (!files.empty() && IsOpenCv(files.front()))
    return RigOfCalibration(Calibration(files), image_width_px, image_height_px);
  RigFromFile out;
  out.rig = LoadLayers<RigParams>(files, {}).MakeRig();
  return out;
}

}  // namespace turbidock::config
