#include "vision/refiner.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>

namespace turbidock::vision {
namespace {

// On the eight path-traced pairs none of these is at an edge: 4 to 8 steps, 24 to 48 places, 3 to
// 12 DN, edges of 0.05 px, no prior to speak of and a bloom of 10 px give the same errors within a
// tenth. An edge noise of 0.5 px (a quarter of the pairs beyond 2 mm) and no bloom (half) do not.
constexpr int kSteps = 6;                 // Gauss-Newton, at most
constexpr int kCommonSteps = 2;           // of them before balls are asked whether they differ
constexpr int kOutlinePoints = 32;        // places across each ball's outline in each image
constexpr int kMaxSamples = 65;           // along one line across an outline
constexpr double kMinContrast_dn = 6;     // of an edge: four times a noise of 1.5 DN
constexpr double kEdgeNoise_px = 0.15;    // of one edge, what small errors of the model do included
constexpr double kPriorPosition_m = 0.1;  // how well the search alone is trusted
constexpr double kPriorRotation_rad = 0.2;
// How near an edge must be to the outline to agree with it. Of right poses in 361 altered pairs
// (path-traced, F at least 0.6) and of poses turned about two of the balls there, the least support
// of a ball is over 0.3 in 99.7 and 0.6 %; with 1 px in 99.7 and 10 %, with 0.25 px in 95 and 0.6
// %.
constexpr double kAgreed_px = 0.5;
constexpr double kBloom_px = 2;  // how much all outlines may be wider or narrower
// How much one ball may be more so, and the difference of balls from which on it may. On the
// path-traced pairs balls differ by less than 0.1 px, of composite video beyond 1.2 m by 0.4 to
// 0.8. Allowed everywhere, it turns one of those pairs by 0.4 degrees.
constexpr double kBallBloom_px = 0.5, kBallsDiffer_px = 0.2;

// What the outline of one ball in one image is off by, beside what scatters from edge to edge: as a
// whole, to the side. Fitted by likelihood to 495 right and detected estimates of simulated and
// path-traced pairs, most of them altered, and judged on 513 others (assets/measured/estimator.md).
constexpr double kShift_px = 0.014;     // always
constexpr double kShiftByBloom = 0.21;  // of what all outlines look narrower: shading does that
constexpr double kShift2BySeen = 0.6;   // of the mean square by which outlines are off each other
constexpr double kShiftByWidth = 0.04;  // of an edge's width beyond a sharp one's
constexpr double kSharpWidth_px = 2;    // median over images that nobody blurred
constexpr double kRadiusToShift = 2;    // error of a radius over that of a shift
// JPEG and video keep colour coarser than brightness, in blocks, which move outlines as a whole:
// of what widens edges of colour only, beyond what shading makes of it, over the number of blocks
// that a ball covers. Fitted by likelihood to 224 estimates of path-traced pairs of JPEG.
constexpr double kShiftByColour = 0.15;
constexpr double kWiderByShading_px = 2;
constexpr double kColourBlock_px = 16;

struct Step {
  double at = 0;        // in samples from the first
  double contrast = 0;  // level before less level after
  double slope = 0;     // at the fall, of a sample
};

// The fall in a signal that explains it best as two levels, to a fraction of a sample.
std::optional<Step> LocateFall(std::span<const float> signal) {
  const int count = static_cast<int>(signal.size());
  const auto level = [&](int i) { return static_cast<double>(signal[static_cast<size_t>(i)]); };
  constexpr int kMinSamples = 2;  // samples on either side
  double total = 0;
  for (int i = 0; i < count; ++i) total += level(i);
  double before = 0, most = 0;
  Step step;
  int at = -1;
  for (int i = 0; i < count - kMinSamples; ++i) {
    before += level(i);
    const int n = i + 1;
    if (n < kMinSamples) continue;
    const double fall = before / n - (total - before) / (count - n);
    // What two levels explain of the signal's variance.
    const double explained = fall > 0 ? fall * fall * n * (count - n) : 0;
    if (explained <= most) continue;
    most = explained;
    at = i;
    step.contrast = fall;
  }
  if (at < 0) return std::nullopt;
  // Both levels next to the fall, then where the signal crosses their mean.
  const int width = std::min({4, at + 1, count - 1 - at});
  double high = 0, low = 0;
  for (int i = 0; i < width; ++i) {
    high += level(at - i);
    low += level(at + 1 + i);
  }
  const double middle = 0.5 * (high + low) / width;
  int nearest = -1;
  double crossing = 0;
  for (int i = std::max(0, at - 2); i < std::min(count - 1, at + 3); ++i) {
    const double a = level(i), b = level(i + 1);
    if (!(a > middle && b <= middle)) continue;
    if (nearest >= 0 && std::abs(i - at) >= std::abs(nearest - at)) continue;
    nearest = i;
    crossing = i + (a - middle) / (a - b);
    step.slope = a - b;
  }
  if (nearest < 0) return std::nullopt;
  step.at = crossing;
  return step;
}

// Signal at a place between pixels; the four around it must be inside the image.
float Bilinear(const Image3u8& image, const Eigen::Vector3f& axis, float u, float v) {
  const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
  const float fu = u - static_cast<float>(u0), fv = v - static_cast<float>(v0);
  const auto signal = [&](int column, int row) {
    const uint8_t* rgb = image.at(column, row);
    return axis[0] * rgb[0] + axis[1] * rgb[1] + axis[2] * rgb[2];
  };
  return (1 - fv) * ((1 - fu) * signal(u0, v0) + fu * signal(u0 + 1, v0)) +
         fv * ((1 - fu) * signal(u0, v0 + 1) + fu * signal(u0 + 1, v0 + 1));
}

bool Holds(const PixelRegion& region, const Eigen::Vector2f& at) {
  return at.x() >= static_cast<float>(region.column_begin) &&
         at.y() >= static_cast<float>(region.row_begin) &&
         at.x() < static_cast<float>(region.column_end - 1) &&
         at.y() < static_cast<float>(region.row_end - 1);
}

// The scale of the robust weights: 1.5 times the median, at least the edges' own noise. `sorted` is
// room to work in.
double RobustScale(const std::vector<double>& residuals_px, std::vector<double>* sorted) {
  sorted->clear();
  for (const double r : residuals_px) sorted->push_back(std::abs(r));
  const auto middle = sorted->begin() + static_cast<std::ptrdiff_t>(sorted->size() / 2);
  std::nth_element(sorted->begin(), middle, sorted->end());
  return std::max(1.4826 * *middle, kEdgeNoise_px);
}

}  // namespace

PoseRefiner::PoseRefiner(const MarkerParams& marker, const StereoRig& rig)
    : marker_(marker), rig_(rig) {
  CheckFields(marker, "marker");
  for (size_t b = 0; b < marker.balls.size(); ++b)
    for (int k = 0; k < 3; ++k)
      hue_axis_[b][k] = 2.0 / 3 * std::cos(marker.balls[b].hue_rad - 2 * std::numbers::pi * k / 3);
  for (int i = 0; i < kOutlinePoints; ++i) {
    const double angle_rad = 2 * std::numbers::pi * (i + 0.5) / kOutlinePoints;
    circle_.emplace_back(std::cos(angle_rad), std::sin(angle_rad));
  }
  edges_.reserve(2 * marker.balls.size() * circle_.size());
  residuals_px_.reserve(edges_.capacity());
  sorted_.reserve(edges_.capacity());
}

// Whether the box or another ball meets the viewing ray before that distance.
bool PoseRefiner::IsHidden(int ball, const Eigen::Vector3d& p_MC, const Eigen::Vector3d& ray_M,
                           double distance_m) const {
  if (marker_.box_m.minCoeff() > 0) {
    double enter_m = 0, leave_m = distance_m;
    for (int k = 0; k < 3; ++k) {
      const double half_m = 0.5 * marker_.box_m[k];
      const double slope = std::abs(ray_M[k]) > 1e-12 ? ray_M[k] : 1e-12;
      const double a_m = (-half_m - p_MC[k]) / slope, b_m = (half_m - p_MC[k]) / slope;
      enter_m = std::max(enter_m, std::min(a_m, b_m));
      leave_m = std::min(leave_m, std::max(a_m, b_m));
    }
    if (enter_m < leave_m) return true;
  }
  for (int b = 0; b < static_cast<int>(marker_.balls.size()); ++b) {
    if (b == ball) continue;
    const BallParams& other = marker_.balls[static_cast<size_t>(b)];
    const Eigen::Vector3d p_CQ_M = other.p_MQ_m - p_MC;
    const double along_m = p_CQ_M.dot(ray_M);
    if (along_m > 0 && along_m < distance_m &&
        (p_CQ_M - along_m * ray_M).squaredNorm() < other.radius_m * other.radius_m)
      return true;
  }
  return false;
}

void PoseRefiner::FindEdges(const Image3u8& image, const PixelRegion& region, Side side,
                            const Pose& X_HM, double shrink) {
  const MountedCamera& camera = rig_[side];
  const Pose X_CM = camera.X_HC.Inverse() * X_HM;
  const Pose X_MC = X_CM.Inverse();
  for (int b = 0; b < static_cast<int>(marker_.balls.size()); ++b) {
    const BallParams& ball = marker_.balls[static_cast<size_t>(b)];
    const Eigen::Vector3d p_CQ = X_CM * ball.p_MQ_m;
    const double distance2 = p_CQ.squaredNorm(), radius2 = ball.radius_m * ball.radius_m;
    if (p_CQ.z() < kNearestDepth_m || distance2 <= 4 * radius2) continue;
    // The circle in which viewing rays touch the sphere.
    const Eigen::Vector3d circle_center = (1 - radius2 / distance2) * p_CQ;
    const double circle_radius_m = ball.radius_m * std::sqrt(1 - radius2 / distance2);
    const Eigen::Vector3d across = p_CQ.cross(Eigen::Vector3d::UnitY()).normalized();
    const Eigen::Vector3d down = p_CQ.cross(across).normalized();
    const Eigen::Vector2d center_px = camera.Project(p_CQ);
    const double radius_px = camera.fx_px * ball.radius_m / p_CQ.z();
    const double reach_px = std::min(Reach_px(shrink * radius_px), 0.5 * (kMaxSamples - 1));
    const int count = 2 * static_cast<int>(reach_px) + 1;
    const Eigen::Vector3f axis = hue_axis_[static_cast<size_t>(b)].cast<float>();
    for (const Eigen::Vector2d& way : circle_) {
      const Eigen::Vector3d offset = circle_radius_m * (way.x() * across + way.y() * down);
      const Eigen::Vector3d p_CT = circle_center + offset;
      if (p_CT.z() < kNearestDepth_m) continue;
      // The outline itself and a little inside of it must be in sight.
      bool hidden = false;
      for (const double share : {1.0, 0.7}) {
        const Eigen::Vector3d p_CS = circle_center + share * offset;
        const double distance_m = p_CS.norm();
        hidden = hidden || IsHidden(b, X_MC.p, X_MC.q * (p_CS / distance_m), distance_m);
      }
      if (hidden) continue;
      const Eigen::Vector2d outline_px = camera.Project(p_CT);
      const Eigen::Vector2d outward = (outline_px - center_px).normalized();
      const Eigen::Vector2f first =
          (outline_px - outward * static_cast<int>(reach_px)).cast<float>();
      const Eigen::Vector2f step = outward.cast<float>();
      const Eigen::Vector2f last = first + static_cast<float>(count - 1) * step;
      if (!Holds(region, first) || !Holds(region, last)) continue;
      ++in_sight_[side][static_cast<size_t>(b)];
      std::array<float, kMaxSamples> signal;
      for (int i = 0; i < count; ++i) {
        const Eigen::Vector2f at = first + static_cast<float>(i) * step;
        signal[static_cast<size_t>(i)] = Bilinear(image, axis, at.x(), at.y());
      }
      const std::optional<Step> fall =
          LocateFall(std::span(signal).first(static_cast<size_t>(count)));
      if (!fall || fall->contrast < kMinContrast_dn) continue;
      const Eigen::Vector2d edge_px = first.cast<double>() + fall->at * outward;
      edges_.push_back({.ball = b,
                        .side = side,
                        .ray_C = camera.RayAt(edge_px.x(), edge_px.y()).normalized(),
                        .width_px = fall->contrast / fall->slope});
    }
  }
}

// Sets the edges' residuals and rows: how far their viewing rays are from the spheres, in pixels,
// with the outlines bloomed as `moved` says.
void PoseRefiner::Linearise(const Pose& X_HM, const Unknowns& moved) {
  residuals_px_.clear();
  for (Edge& edge : edges_) {
    const BallParams& ball = marker_.balls[static_cast<size_t>(edge.ball)];
    const MountedCamera& camera = rig_[edge.side];
    const Eigen::Vector3d arm_H = X_HM.q * ball.p_MQ_m;
    const Eigen::Vector3d p_CQ = camera.X_HC.Inverse() * (X_HM.p + arm_H);
    const Eigen::Vector3d off_C = p_CQ - p_CQ.dot(edge.ray_C) * edge.ray_C;
    const double off_m = off_C.norm();
    const Eigen::Vector3d n_C = off_C / off_m;
    const Eigen::Vector3d n_H = camera.X_HC.q * n_C;
    const double px_per_m = camera.fx_px / p_CQ.norm();
    const double along_lines = n_C.x() * n_C.x();
    edge.row << px_per_m * n_H, px_per_m * arm_H.cross(n_H), -1;
    edge.ball_row << -along_lines, along_lines - 1;
    double bloom_px = moved[kCommon - 1];
    if (moved.size() > kCommon)
      bloom_px -= edge.ball_row.dot(moved.segment<2>(kCommon + 2 * edge.ball));
    residuals_px_.push_back((off_m - ball.radius_m) * px_per_m - bloom_px);
  }
}

// Whether balls look wider or narrower by different amounts, by the residuals of the last step.
bool PoseRefiner::BallsDiffer() const {
  constexpr double kFewest = 4;  // edges of a ball that count
  std::array<double, kMaxBalls> sum_px{}, weight{};
  for (size_t i = 0; i < edges_.size(); ++i) {
    const auto b = static_cast<size_t>(edges_[i].ball);
    sum_px[b] += edges_[i].weight * residuals_px_[i];
    weight[b] += edges_[i].weight;
  }
  double least_px = std::numeric_limits<double>::infinity(), most_px = -least_px;
  for (size_t b = 0; b < marker_.balls.size(); ++b) {
    if (weight[b] <= kFewest) continue;
    least_px = std::min(least_px, sum_px[b] / weight[b]);
    most_px = std::max(most_px, sum_px[b] / weight[b]);
  }
  return most_px - least_px > kBallsDiffer_px;
}

std::optional<Refined> PoseRefiner::Refine(const StereoImage& seen, const StereoRegion& region,
                                           const Pose& X_HM) {
  constexpr int kMinEdges = 12;
  Refined refined{.X_HM = X_HM};
  Unknowns moved = Unknowns::Zero(kCommon);  // since X_HM, for the prior
  Unknowns prior_weight(kCommon);
  prior_weight << Eigen::Vector3d::Constant(std::pow(kPriorPosition_m, -2)),
      Eigen::Vector3d::Constant(std::pow(kPriorRotation_rad, -2)), std::pow(kBloom_px, -2);
  for (int iteration = 0; iteration < kSteps; ++iteration) {
    edges_.clear();
    in_sight_ = {};
    const double shrink = iteration == 0 ? 1 : 0.5;  // close by now
    for (const Side side : kSides) FindEdges(seen[side], region[side], side, refined.X_HM, shrink);
    if (edges_.size() < kMinEdges) return std::nullopt;

    Linearise(refined.X_HM, moved);
    const double scale_px = RobustScale(residuals_px_, &sorted_);
    const double tukey_px = 4 * scale_px;
    Information information = prior_weight.asDiagonal();
    Unknowns gradient = prior_weight.cwiseProduct(moved);
    double sum2 = 0, weights = 0;
    refined.edges = 0;
    for (size_t i = 0; i < edges_.size(); ++i) {
      const double r = residuals_px_[i];
      if (std::abs(r) >= tukey_px) continue;
      Edge& edge = edges_[i];
      const double u = r / tukey_px;
      edge.weight = (1 - u * u) * (1 - u * u);
      const double weight = edge.weight / (scale_px * scale_px);
      information.topLeftCorner<kCommon, kCommon>() += weight * edge.row * edge.row.transpose();
      gradient.head<kCommon>() += weight * r * edge.row;
      if (moved.size() > kCommon) {
        // LDLT reads the lower triangle only.
        const Eigen::Index at = kCommon + 2 * edge.ball;
        information.block<2, kCommon>(at, 0) += weight * edge.ball_row * edge.row.transpose();
        information.block<2, 2>(at, at) += weight * edge.ball_row * edge.ball_row.transpose();
        gradient.segment<2>(at) += weight * r * edge.ball_row;
      }
      sum2 += edge.weight * r * r;
      weights += edge.weight;
      ++refined.edges;
    }
    if (refined.edges < kMinEdges) return std::nullopt;
    const Unknowns delta = -information.ldlt().solve(gradient);
    moved += delta;
    refined.X_HM.p += delta.head<3>();
    const Eigen::Vector3d turn = delta.segment<3>(3);
    if (turn.norm() > 0)
      refined.X_HM.q =
          (Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * refined.X_HM.q)
              .normalized();
    refined.residual_px = std::sqrt(sum2 / std::max(weights, 1e-12));
    refined.bloom_px = moved[kCommon - 1];
    const bool is_last = iteration == kSteps - 1;
    const bool has_settled = iteration > 0 && delta.head<3>().norm() < 5e-5 && turn.norm() < 3e-4;
    if (!is_last && moved.size() == kCommon && (has_settled || iteration == kCommonSteps - 1) &&
        BallsDiffer()) {
      const Eigen::Index all = kCommon + 2 * std::ssize(marker_.balls);
      moved.conservativeResizeLike(Unknowns::Zero(all));
      prior_weight.conservativeResizeLike(Unknowns::Constant(all, std::pow(kBallBloom_px, -2)));
      continue;
    }
    if (!has_settled && !is_last) continue;
    refined.covariance = Covariance(refined, BrightnessWidth_px(seen, region, refined.X_HM),
                                    prior_weight, information, scale_px);
    break;
  }
  CountSupport(&refined);
  return refined;
}

// Median over some edges of the last step; nothing where there is no contrast of brightness.
std::optional<double> PoseRefiner::BrightnessWidth_px(const StereoImage& seen,
                                                      const StereoRegion& region,
                                                      const Pose& X_HM) {
  constexpr size_t kEvery = 4;  // edges; they are neighbours
  constexpr size_t kSamples = 11;
  constexpr int kReach = kSamples / 2;
  const Eigen::Vector3f brightness(0.299F, 0.587F, 0.114F);
  sorted_.clear();
  for (size_t i = 0; i < edges_.size(); i += kEvery) {
    const Edge& edge = edges_[i];
    const MountedCamera& camera = rig_[edge.side];
    const Eigen::Vector3d& p_MQ = marker_.balls[static_cast<size_t>(edge.ball)].p_MQ_m;
    const Eigen::Vector2d at = camera.Project(edge.ray_C),
                          center = camera.Project(camera.X_HC.Inverse() * (X_HM * p_MQ));
    const Eigen::Vector2f step = (at - center).normalized().cast<float>();
    const Eigen::Vector2f middle = at.cast<float>();
    if (!Holds(region[edge.side], middle - kReach * step) ||
        !Holds(region[edge.side], middle + kReach * step))
      continue;
    std::array<float, kSamples> signal;
    float rise = 0;
    for (size_t n = 0; n < kSamples; ++n) {
      const int k = static_cast<int>(n) - kReach;
      const Eigen::Vector2f place = middle + static_cast<float>(k) * step;
      float& value = signal[n];
      value = Bilinear(seen[edge.side], brightness, place.x(), place.y());
      rise += k < 0 ? -value : k > 0 ? value : 0;
    }
    if (rise > 0)
      for (float& value : signal) value = -value;
    const std::optional<Step> fall = LocateFall(signal);
    if (fall && fall->contrast >= kMinContrast_dn) sorted_.push_back(fall->contrast / fall->slope);
  }
  if (sorted_.empty()) return std::nullopt;
  const auto half = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), half, sorted_.end());
  return *half;
}

// By the edges and residuals of the last step. Were the edges' errors independent, the inverse of
// the information would be the covariance. They are not: blur, shading, glow and compression move
// or swell a ball's whole outline in an image. With N for the information, the estimate's error is
// N^-1 times the weighted sum of the errors, whose covariance is the sum of
//   the scatter of single edges, the errors that edges of a ball in an image share, and the prior.
PoseCovariance PoseRefiner::Covariance(const Refined& refined,
                                       const std::optional<double>& brightness_width_px,
                                       const Unknowns& prior_weight, const Information& information,
                                       double scale_px) {
  constexpr double kFewest = 4, kRidge = 0.5;  // edges of an outline whose shift is looked at
  // Of an outline: radius and shift, by whose sums over its edges its errors act and are seen.
  struct Outline {
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostUnknowns> pull = {};
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d residual = Eigen::Vector3d::Zero();
    double weight = 0;
  };
  std::array<Outline, 2 * kMaxBalls> outlines;
  const auto all = std::span(outlines).first(2 * marker_.balls.size());
  const Eigen::Index unknowns = prior_weight.size();
  for (Outline& of : all) of.pull.setZero(3, unknowns);
  const double variance_px2 = scale_px * scale_px;
  Information spread = Information::Zero(unknowns, unknowns);
  sorted_.clear();
  for (size_t i = 0; i < edges_.size(); ++i) {
    const Edge& edge = edges_[i];
    if (edge.weight == 0) continue;
    Outline& of = all[2 * static_cast<size_t>(edge.ball) + (edge.side == Side::kLeft ? 0 : 1)];
    Eigen::Vector3d ways(1, edge.row[1], edge.row[2]);  // y and z of H span the images
    ways.tail<2>().normalize();
    Unknowns pulled = Unknowns::Zero(unknowns);
    pulled.head<kCommon>() = edge.weight / variance_px2 * edge.row;
    if (unknowns > kCommon)
      pulled.segment<2>(kCommon + 2 * edge.ball) = edge.weight / variance_px2 * edge.ball_row;
    spread += pulled * pulled.transpose();
    of.pull += ways * pulled.transpose();
    of.normal += edge.weight * ways * ways.transpose();
    of.residual += edge.weight * residuals_px_[i] * ways;
    of.weight += edge.weight;
    sorted_.push_back(edge.width_px);
  }
  double seen2 = 0;
  int looked_at = 0;
  for (const Outline& of : all) {
    if (of.weight <= kFewest) continue;
    const Eigen::Matrix3d normal = of.normal + kRidge * Eigen::Matrix3d::Identity();
    seen2 += normal.ldlt().solve(of.residual).squaredNorm() / 3;
    ++looked_at;
  }
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  const double by_bloom_px = kShiftByBloom * std::min(refined.bloom_px, 0.0);
  const double by_width_px = kShiftByWidth * std::max(*middle - kSharpWidth_px, 0.0);
  // widths of what blurs one after the other add as squares do
  const double brightness_px = brightness_width_px.value_or(*middle);
  const double wider_px =
      std::sqrt(std::max(*middle * *middle - brightness_px * brightness_px, 0.0));
  const double coarse_px = kShiftByColour * std::max(wider_px - kWiderByShading_px, 0.0);
  const double shift2_px2 = kShift_px * kShift_px + by_bloom_px * by_bloom_px +
                            by_width_px * by_width_px +
                            kShift2BySeen * seen2 / std::max(looked_at, 1);
  spread *= refined.residual_px * refined.residual_px;
  spread += prior_weight.asDiagonal();
  for (size_t i = 0; i < all.size(); ++i) {
    const BallParams& ball = marker_.balls[i / 2];
    const double radius_px = rig_.left.fx_px * ball.radius_m / (refined.X_HM * ball.p_MQ_m).norm();
    const double by_colour_px = coarse_px * std::pow(kColourBlock_px / radius_px, 2);
    const Eigen::Vector3d error2_px2 = (shift2_px2 + by_colour_px * by_colour_px) *
                                       Eigen::Vector3d(kRadiusToShift * kRadiusToShift, 1, 1);
    spread += all[i].pull.transpose() * error2_px2.asDiagonal() * all[i].pull;
  }
  const Information inverse = information.ldlt().solve(Information::Identity(unknowns, unknowns));
  return (inverse * spread * inverse).topLeftCorner<6, 6>();
}

// By the edges and residuals of the last step.
void PoseRefiner::CountSupport(Refined* refined) const {
  Stereo<std::array<int, kMaxBalls>> agreed;
  for (size_t i = 0; i < edges_.size(); ++i)
    if (std::abs(residuals_px_[i]) < kAgreed_px)
      ++agreed[edges_[i].side][static_cast<size_t>(edges_[i].ball)];
  const auto share = [](int some, int all) {
    constexpr int kLeastPlaces = 8;  // one or two edges that agree by chance are no support
    return some / static_cast<double>(std::max(all, kLeastPlaces));
  };
  for (size_t b = 0; b < marker_.balls.size(); ++b)
    refined->support[b] =
        share(agreed.left[b] + agreed.right[b], in_sight_.left[b] + in_sight_.right[b]);
  for (const Side side : kSides)
    refined->camera_support[side] =
        share(std::accumulate(agreed[side].begin(), agreed[side].end(), 0),
              std::accumulate(in_sight_[side].begin(), in_sight_[side].end(), 0));
}

}  // namespace turbidock::vision
