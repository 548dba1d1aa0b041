#include "experiments/trial/perception.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/base/published.h"

namespace turbidock::trial {
namespace {

constexpr double kNothing = -0.2;         // fitness of a ball that is not there: published rule
constexpr double kNoiseDistance_m = 0.6;  // where the noise is what the parameters say

}  // namespace

TruePose::TruePose(const TruePoseParams& params, const vision::MarkerParams& marker,
                   const StereoRig& rig, double frame_s, Rng rng)
    : params_(params), marker_(marker), rig_(rig), frame_s_(frame_s), rng_(rng) {
  CheckFields(params_, "");
}

const PoseEstimate& TruePose::Update(int64_t frame, const Pose& X_HM) {
  // A Gauss-Markov process for any correlation; always four draws, whatever is in sight.
  const double keep = params_.correlation_s > 0 ? std::exp(-frame_s_ / params_.correlation_s) : 0;
  for (double& noise : noise_)
    noise = started_ ? keep * noise + std::sqrt(1 - keep * keep) * rng_.Normal() : rng_.Normal();
  started_ = true;

  // Triangulation: bearings are equally good everywhere, depth is not.
  const double far = X_HM.p.x() / kNoiseDistance_m;
  const Eigen::Vector4d error =
      noise_.cwiseProduct(params_.noise).cwiseProduct(Eigen::Vector4d(far * far, far, far, far));
  const double fitness = Fitness(X_HM);
  frames_in_sight_ = fitness >= published::kDetectedFitness ? frames_in_sight_ + 1 : 0;
  const bool found = static_cast<double>(frames_in_sight_) * frame_s_ > params_.found_after_s;
  estimate_.frame = frame;
  estimate_.X_HM =
      Pose{FromYawPitchRoll(error[3], 0, 0) * X_HM.q, X_HM.p + error.head<3>()}.Canonical();
  estimate_.fitness = found ? fitness : kNothing;
  return estimate_;
}

double TruePose::Fitness(const Pose& X_HM) const {
  const bool in_range = X_HM.p.x() >= params_.nearest_m && X_HM.p.x() <= params_.farthest_m;
  double sum = 0;
  for (const Side side : kSides) {
    const MountedCamera& camera = rig_[side];
    const Pose X_CM = camera.X_HC.Inverse() * X_HM;
    for (const vision::BallParams& ball : marker_.balls) {
      const Eigen::Vector3d p_CQ = X_CM * ball.p_MQ_m;
      bool seen = in_range && p_CQ.z() > vision::kNearestDepth_m;
      if (seen) {
        const vision::BallCircle circle = vision::ProjectBall(camera, p_CQ, ball.radius_m);
        seen = circle.u_px >= 0 && circle.u_px <= camera.width_px - 1 && circle.v_px >= 0 &&
               circle.v_px <= camera.height_px - 1;
      }
      sum += seen ? params_.fitness : kNothing;
    }
  }
  return sum / (2 * static_cast<double>(marker_.balls.size()));
}

Perception::Perception(const Scenario& scenario, const TrialOptions& options, World* world)
    : world_(*world),
      timer_(options.timer),
      clock_(scenario.clock),
      schedule_(scenario.camera_period_frames, scenario.camera_delay_frames),
      region_of_interest_(scenario.region_of_interest),
      whole_images_(options.whole_images || !scenario.region_of_interest),
      whole_every_(options.whole_images_every),
      shows_true_pose_(options.whole_images && scenario.pose_source == PoseSource::kTruePose),
      drop_probability_(scenario.camera_drop_probability),
      drops_(world->seeds().Stream("camera.drops")),
      snapshots_(static_cast<size_t>(schedule_.under_way()) + 1),
      noisy_(scenario.sensor.noisy()),
      image_s_(scenario.image_clock().frame_s()) {
  const SeedTree& seeds = world_.seeds();
  if (scenario.pose_source == PoseSource::kCameras) {
    const std::string name = scenario.estimator_name();
    estimator_ = scenario.MakeEstimator(name, seeds.Stream("vision." + name));
    estimator_->set_timer(options.timer);
  } else {
    true_pose_.emplace(scenario.true_pose, scenario.marker, scenario.rig.MakeRig(),
                       scenario.image_clock().frame_s(), seeds.Stream("true_pose"));
  }
  for (int64_t frame = schedule_.first_frame(); frame < 0; ++frame) Process(frame);
}

bool Perception::Update(int64_t frame) {
  Process(frame);
  if (!schedule_.ArrivesAt(frame)) return false;
  // what came first must have come: there is no estimate before it
  if (drop_probability_ > 0 && drops_.Uniform() < drop_probability_ && estimate_ != nullptr)
    return false;
  const int64_t number = schedule_.LatestAt(frame);
  const bool whole = whole_images_ || (whole_every_ > 0 && frame % whole_every_ == 0);
  if (estimator_) {
    ProcessImages(number, whole);
  } else {
    if (shows_true_pose_)
      world_.RenderImages(*Slot(number), number, std::nullopt, timer_, &latest_);
    estimate_ = &true_pose_->Update(number, Slot(number)->true_X_HM);
  }
  image_time_s_ = clock_.TimeOfFrame(std::max<int64_t>(0, schedule_.ExposureOf(frame)));
  true_at_image_X_HM_ = Slot(number)->true_X_HM;
  Lap(timer_, LoopStage::kEstimate);
  return true;
}

std::string Perception::name() const {
  return std::string(estimator_ ? estimator_->name() : NameOf(PoseSource::kTruePose));
}

void Perception::ProcessImages(int64_t number, bool whole) {
  std::swap(latest_, before_);
  seen_ = &latest_;
  const auto region = whole ? std::nullopt : estimator_->RegionOfInterest();
  world_.RenderImages(*Slot(number), number, region, timer_, &latest_);
  for (const Side side : kSides) {
    const bool again = noisy_ && latest_[side] == before_[side];
    repeats_[side] = again ? repeats_[side] + 1 : 0;
    if (!again) continue;
    ++repeated_images_;
    if (seen_ == &latest_) moving_ = latest_;
    std::fill_n(moving_[side].data(), 3 * moving_[side].pixels(), uint8_t{0});
    seen_ = &moving_;
  }
  estimate_ = &estimator_->Update(*seen_);
}

std::string Perception::RepeatRemark() const {
  std::string remark;
  for (const Side side : kSides)
    if (repeats_[side] > 0)
      remark += fmt::format("; the {} camera has given the same image for {:.1f} s",
                            side == Side::kLeft ? "left" : "right",
                            static_cast<double>(repeats_[side]) * image_s_);
  return remark;
}

Snapshot* Perception::Slot(int64_t number) {
  const int64_t n = std::ssize(snapshots_);
  return &snapshots_[static_cast<size_t>((number % n + n) % n)];
}

void Perception::Process(int64_t frame) {
  if (schedule_.ExposesAt(frame)) world_.Capture(Slot(schedule_.ExposedAt(frame)));
}

}  // namespace turbidock::trial
