#include "experiments/config/rig_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>

#include "experiments/config/yaml_fields.h"
#include "experiments/system/output_path.h"

namespace turbidock::config {
namespace {

// OpenCV's own first line is not quite YAML's.
bool IsOpenCv(const std::string& text) {
  return text.starts_with("%YAML:1.0") || text.starts_with("%YAML 1.0");
}

using Names = std::initializer_list<const char*>;

template <class V>
V ValueOf(const YamlNode& at) {
  V value{};
  ReadValue(at, &value);
  return value;
}

// The matrices of a calibration, whichever of the files holds them.
struct Calibration {
  std::string where;  // the files' names
  std::vector<YamlNode> files;

  // The first of these names that is there.
  std::optional<YamlNode> Find(Names names) const {
    for (const char* name : names)
      for (const YamlNode& file : files)
        if (std::optional<YamlNode> node = file.Find(name)) return node;
    return std::nullopt;
  }

  // Row by row. `sizes`: the numbers of elements that are allowed.
  std::vector<double> Matrix(Names names, std::initializer_list<size_t> sizes) const {
    const std::optional<YamlNode> node = Find(names);
    if (!node) throw ConfigError(where + ": " + *names.begin() + ": this key is required");
    const std::optional<YamlNode> data = node->IsMap() ? node->Find("data") : std::nullopt;
    if (!data) node->Fail("is no matrix: it has no data");
    std::vector<double> values = ValueOf<std::vector<double>>(*data);
    if (std::ranges::find(sizes, values.size()) == sizes.end())
      node->Fail(
          fmt::format("has {} elements, must have {}", values.size(), fmt::join(sizes, " or ")));
    const auto rows = node->Find("rows"), cols = node->Find("cols");
    if (!rows || !cols || int64_t{ValueOf<int>(*rows)} * ValueOf<int>(*cols) != std::ssize(values))
      node->Fail("has not as many elements as rows times cols");
    return values;
  }
};

Calibration LoadCalibration(const std::vector<std::string>& files) {
  Calibration calibration{.where = fmt::format("{}", fmt::join(files, ", ")), .files = {}};
  for (const std::string& file : files) {
    std::string text = system::ReadWhole(file);
    if (!IsOpenCv(text)) throw ConfigError(file + ": is no calibration that OpenCV wrote as YAML");
    text[0] = '#';  // its lines keep their numbers
    calibration.files.push_back(ParseYaml(text, file, "!!opencv-matrix"));
  }
  return calibration;
}

struct ImageSize {
  int width_px = 0, height_px = 0;
};

// Pixels of a side of the images; OpenCV may have written them as "640.".
int SideIn(const YamlNode& at) {
  constexpr double kLargest_px = 8192;
  const auto side_px = ValueOf<double>(at);
  if (!(side_px >= 1 && side_px <= kLargest_px) || side_px != std::floor(side_px))
    at.Fail(fmt::format("is {}, must be a whole number in [1, {}]", FormatNumber(side_px),
                        kLargest_px));
  return static_cast<int>(side_px);
}

// Where the calibration says it.
std::optional<ImageSize> SizeIn(const Calibration& calibration) {
  const auto width = calibration.Find({"image_width"}), height = calibration.Find({"image_height"});
  if (width && height) return ImageSize{SideIn(*width), SideIn(*height)};
  if (width) width->Fail("stands alone: image_height is required");
  if (height) height->Fail("stands alone: image_width is required");
  const auto size = calibration.Find({"imageSize", "image_size", "size"});
  if (!size) return std::nullopt;
  const std::vector<YamlNode> sides = size->Elements();
  if (sides.size() != 2) size->Fail("must be a list of width and height");
  return ImageSize{SideIn(sides[0]), SideIn(sides[1])};
}

CameraIntrinsics IntrinsicsOf(const std::vector<double>& matrix, const std::string& where,
                              const ImageSize& size) {
  CameraIntrinsics camera{size.width_px, size.height_px, matrix[0],
                          matrix[4],     matrix[2],      matrix[5]};
  if (!(camera.fx_px > 0 && camera.fy_px > 0))
    throw ConfigError(where + ": the focal lengths of a camera matrix must be > 0");
  if (matrix[1] != 0) throw ConfigError(where + ": a camera matrix with skew is not supported");
  RigParams own;  // sees as much as a rig of ours may
  for (const double focal_px : {camera.fx_px, camera.fy_px}) {
    own.horizontal_fov_rad = 2 * std::atan(camera.width_px / (2 * focal_px));
    try {
      CheckFields(own, "");
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("{}: a focal length of {} pixels: {}", where,
                                    FormatNumber(focal_px), error.what()));
    }
  }
  if (!InRange(0, camera.width_px).Contains(camera.cx_px) ||
      !InRange(0, camera.height_px).Contains(camera.cy_px))
    throw ConfigError(fmt::format("{}: the principal point ({}, {}) is not in an image of {} x {}",
                                  where, FormatNumber(camera.cx_px), FormatNumber(camera.cy_px),
                                  camera.width_px, camera.height_px));
  return camera;
}

vision::LensDistortion DistortionOf(std::vector<double> d, const std::string& where) {
  constexpr double kMost = 1000;  // of a fit to any lens
  for (const double k : d)
    if (!InRange(-kMost, kMost).Contains(k))
      throw ConfigError(fmt::format("{}: a distortion of {} must be in [{}, {}]", where,
                                    FormatNumber(k), -kMost, kMost));
  d.resize(8);
  return {d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7]};
}

RigFromFile RigOfCalibration(const Calibration& calibration, const ImageSize& images) {
  const std::string& where = calibration.where;
  const ImageSize size = SizeIn(calibration).value_or(images);
  RigFromFile out;
  const auto key = [&](Names names) { return where + ": " + *names.begin(); };
  const auto camera = [&](Names names) -> MountedCamera {
    return {IntrinsicsOf(calibration.Matrix(names, {9}), key(names), size), Pose()};
  };
  const auto lens = [&](Names names) {
    return DistortionOf(calibration.Matrix(names, {4, 5, 8}), key(names));
  };
  out.rig = {camera({"M1", "K1", "cameraMatrix1"}), camera({"M2", "K2", "cameraMatrix2"})};
  out.distortion = {lens({"D1", "distCoeffs1"}), lens({"D2", "distCoeffs2"})};

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
  if (!files.empty() && IsOpenCv(system::ReadWhole(files.front())))
    return RigOfCalibration(LoadCalibration(files), {image_width_px, image_height_px});
  RigFromFile out;
  out.rig = LoadLayers<RigParams>(files, {}).MakeRig();
  return out;
}

}  // namespace turbidock::config
