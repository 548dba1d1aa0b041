#include "vision/fiducial_estimator.h"

#include <apriltag/apriltag.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "vision/blob_estimator.h"

namespace turbidock::vision {
namespace {

// Parameters that passed their checks, for the members that are made from them.
const FiducialParams& Checked(const FiducialParams& params) {
  CheckFields(params, "estimator.fiducial");
  if (params.tags.empty())
    throw ConfigError("estimator.fiducial.tags", "must name at least one tag");
  return params;
}

void CheckSize(const Image3u8& image, const CameraIntrinsics& camera, const char* side) {
  if (image.width() != camera.width_px || image.height() != camera.height_px)
    throw ConfigError(std::string(side) + " image", "must have the rig's size");
}

// Luminance of a region (ITU-R BT.601), in integers: the same everywhere.
void Grey(const Image3u8& rgb, const PixelRegion& region, Image1u8* grey) {
  grey->Resize(region.width(), region.height());
  for (int v = 0; v < region.height(); ++v) {
    const uint8_t* in = rgb.at(region.column_begin, region.row_begin + v);
    uint8_t* out = grey->row(v);
    for (int u = 0; u < region.width(); ++u, in += 3)
      out[u] = static_cast<uint8_t>((77 * in[0] + 150 * in[1] + 29 * in[2] + 128) >> 8);
  }
}

}  // namespace

void TagParams::Check(const std::string& path) const {
  if (std::abs(q_MT_wxyz.norm() - 1) > 1e-3)
    throw ConfigError(JoinKey(path, "q_MT_wxyz"),
                      "has length " + FormatNumber(q_MT_wxyz.norm()) + ", must be 1");
}

Pose TagParams::X_MT() const {
  return {Eigen::Quaterniond(q_MT_wxyz[0], q_MT_wxyz[1], q_MT_wxyz[2], q_MT_wxyz[3]).normalized(),
          p_MT_m};
}

void FiducialParams::Check(const std::string& path) const {
  const int codes = TagCount(family);
  for (size_t i = 0; i < tags.size(); ++i) {
    const std::string key = JoinKey(path, "tags[" + std::to_string(i) + "].id");
    if (tags[i].id >= codes)
      throw ConfigError(key, std::to_string(tags[i].id) + " is not in family " + NameOf(family) +
                                 ", which has 0 to " + std::to_string(codes - 1));
    for (size_t j = 0; j < i; ++j)
      if (tags[j].id == tags[i].id)
        throw ConfigError(
            key, std::to_string(tags[i].id) + " is also that of tags[" + std::to_string(j) + "]");
  }
}

void FiducialEstimator::DestroyDetector::operator()(apriltag_detector* detector) const {
  apriltag_detector_destroy(detector);
}

FiducialEstimator::FiducialEstimator(const FiducialParams& params, const StereoRig& rig)
    : params_(Checked(params)),
      rig_(rig),
      codes_(MakeFamily(params.family)),
      detector_(apriltag_detector_create()) {
  apriltag_detector_add_family_bits(detector_.get(), codes_.get(), CorrectedCells(params.family));
  detector_->nthreads = 1;       // works in the calling thread
  detector_->quad_decimate = 1;  // every pixel counts
  detector_->quad_sigma = static_cast<float>(params.blur_px);
  detector_->refine_edges = true;
}

void FiducialEstimator::Read(const Image3u8& image, const PixelRegion& region, Side side) {
  Grey(image, region, &grey_);
  image_u8_t view = {grey_.width(), grey_.height(), grey_.width(), grey_.data()};
  zarray_t* found = apriltag_detector_detect(detector_.get(), &view);
  for (int i = 0; i < zarray_size(found); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found, i, static_cast<void*>(&detection));
    const auto tag = std::ranges::find(params_.tags, detection->id, &TagParams::id);
    if (tag == params_.tags.end()) continue;
    Reading& reading = readings_.emplace_back();
    reading.tag = static_cast<size_t>(tag - params_.tags.begin());
    reading.side = side;
    // Its pixels begin at whole numbers, ours are centred on them.
    for (size_t c = 0; c < 4; ++c)
      reading.corners_px[c] = {region.column_begin + detection->p[c][0] - 0.5,
                               region.row_begin + detection->p[c][1] - 0.5};
  }
  apriltag_detections_destroy(found);
}

Eigen::Vector3d FiducialEstimator::Corner(size_t tag, size_t i) const {
  const TagParams& params = params_.tags[tag];
  const double half = 0.5 * params.size_m;
  const bool left = i == 0 || i == 3, top = i >= 2;
  return params.X_MT() * Eigen::Vector3d(0, left ? half : -half, top ? half : -half);
}

std::optional<PixelRegion> FiducialEstimator::RegionOf(Side side) const {
  // A third of a tag is its white border. At 0.35 m, 0.3 m/s are 16 px a frame, 0.3 rad/s 6 px.
  constexpr double kBorder = 4.0 / 3, kMargin_px = 40;
  const MountedCamera& camera = rig_[side];
  const Pose X_CM = camera.X_HC.Inverse() * estimate_.X_HM;
  Eigen::Vector2d low(camera.width_px, camera.height_px), high(0, 0);
  for (size_t tag = 0; tag < params_.tags.size(); ++tag)
    for (size_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d p_MT = params_.tags[tag].p_MT_m;
      const Eigen::Vector3d p_CQ = X_CM * (p_MT + kBorder * (Corner(tag, i) - p_MT));
      if (p_CQ.z() <= kNearestDepth_m) return std::nullopt;
      const Eigen::Vector2d pixel = camera.Project(p_CQ);
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
  const auto within = [](double px, int size) {
    return static_cast<int>(std::clamp(px, 0.0, static_cast<double>(size)));
  };
  const PixelRegion region = {within(low.x() - kMargin_px, camera.width_px),
                              within(low.y() - kMargin_px, camera.height_px),
                              within(high.x() + kMargin_px, camera.width_px),
                              within(high.y() + kMargin_px, camera.height_px)};
  constexpr int kLeast_px = 32;  // of an image to look for tags in
  if (region.width() < kLeast_px || region.height() < kLeast_px) return std::nullopt;
  return region;
}

double FiducialEstimator::Error_px(const Reading& reading, const Pose& X_HM) const {
  const MountedCamera& camera = rig_[reading.side];
  const Pose X_CM = camera.X_HC.Inverse() * X_HM;
  double sum = 0;
  for (size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d p_CQ = X_CM * Corner(reading.tag, i);
    if (p_CQ.z() <= kNearestDepth_m) return 1e9;
    sum += (camera.Project(p_CQ) - reading.corners_px[i]).squaredNorm();
  }
  return std::sqrt(sum / 4);
}

std::optional<Pose> FiducialEstimator::Solve(const std::vector<Reading>& readings) const {
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  // To begin with: the corners of tags read in both images as points in space.
  Eigen::Matrix3Xd p_MQ(3, 0), p_HQ(3, 0);
  for (const Reading& left : readings)
    for (const Reading& right : readings) {
      if (left.side != Side::kLeft || right.side != Side::kRight || left.tag != right.tag) continue;
      for (size_t i = 0; i < 4; ++i) {
        const auto point = Triangulate(rig_, {left.corners_px[i], right.corners_px[i]});
        if (!point) continue;
        p_MQ.conservativeResize(Eigen::NoChange, p_MQ.cols() + 1);
        p_HQ.conservativeResize(Eigen::NoChange, p_HQ.cols() + 1);
        p_MQ.rightCols<1>() = Corner(left.tag, i);
        p_HQ.rightCols<1>() = *point;
      }
    }
  if (p_MQ.cols() < 4) return std::nullopt;
  const Eigen::Matrix4d X = Eigen::umeyama(p_MQ, p_HQ, /*with_scaling=*/false);
  Pose X_HM = {Eigen::Quaterniond(Eigen::Matrix3d(X.topLeftCorner<3, 3>())).normalized(),
               X.topRightCorner<3, 1>()};

  // Then Gauss-Newton on what the corners miss their pixels by, in all images.
  constexpr int kSteps = 10;
  for (int step = 0; step < kSteps; ++step) {
    Matrix6d information = 1e-9 * Matrix6d::Identity();
    Vector6d gradient = Vector6d::Zero();
    for (const Reading& reading : readings) {
      const MountedCamera& camera = rig_[reading.side];
      const Eigen::Matrix3d R_CH = camera.X_HC.Inverse().R();
      for (size_t i = 0; i < 4; ++i) {
        const Eigen::Vector3d arm_H = X_HM.q * Corner(reading.tag, i);
        const Eigen::Vector3d p_CQ = camera.X_HC.Inverse() * (X_HM.p + arm_H);
        if (p_CQ.z() <= kNearestDepth_m) return std::nullopt;
        Eigen::Matrix<double, 2, 3> by_C;  // of the pixel, by p_CQ
        by_C << camera.fx_px / p_CQ.z(), 0, -camera.fx_px * p_CQ.x() / (p_CQ.z() * p_CQ.z()), 0,
            camera.fy_px / p_CQ.z(), -camera.fy_px * p_CQ.y() / (p_CQ.z() * p_CQ.z());
        Eigen::Matrix3d arm_cross;
        arm_cross << 0, -arm_H.z(), arm_H.y(), arm_H.z(), 0, -arm_H.x(), -arm_H.y(), arm_H.x(), 0;
        Eigen::Matrix<double, 2, 6> by_pose;  // by position and rotation vector in H
        by_pose << by_C * R_CH, -by_C * R_CH * arm_cross;
        const Eigen::Vector2d miss = camera.Project(p_CQ) - reading.corners_px[i];
        information += by_pose.transpose() * by_pose;
        gradient += by_pose.transpose() * miss;
      }
    }
    const Vector6d change = -Eigen::LDLT<Matrix6d>(information).solve(gradient);
    X_HM.p += change.head<3>();
    const Eigen::Vector3d turn = change.tail<3>();
    if (turn.norm() > 0)
      X_HM.q = (Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * X_HM.q)
                   .normalized();
    if (!X_HM.IsFinite()) return std::nullopt;
    if (change.head<3>().norm() < 1e-6 && turn.norm() < 1e-6) break;
  }
  return X_HM.Canonical();
}

const PoseEstimate& FiducialEstimator::Update(const StereoImage& seen) {
  CheckSize(seen.left, rig_.left, "left");
  CheckSize(seen.right, rig_.right, "right");
  readings_.clear();
  const StereoRegion region = region_.value_or(WholeImages(rig_));
  for (const Side side : kSides) Read(seen[side], region[side], side);
  Lap(timer(), LoopStage::kLabels);
  estimate_.frame = seen.frame;
  estimate_.fitness = -1;
  estimate_.detected = false;
  region_.reset();
  // A number that noise read somewhere else disagrees with the rest, or with itself.
  std::vector<Reading> used = readings_;
  while (const std::optional<Pose> X_HM = Solve(used)) {
    const auto worst = std::ranges::max_element(
        used, {}, [&](const Reading& reading) { return Error_px(reading, *X_HM); });
    if (Error_px(*worst, *X_HM) > params_.max_error_px) {
      used.erase(worst);
      continue;
    }
    estimate_.X_HM = *X_HM;
    estimate_.fitness = 1;
    estimate_.detected = true;
    const auto left = RegionOf(Side::kLeft), right = RegionOf(Side::kRight);
    if (left && right) region_ = StereoRegion{*left, *right};
    break;
  }
  return estimate_;
}

}  // namespace turbidock::vision
