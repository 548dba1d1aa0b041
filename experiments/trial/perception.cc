#include "experiments/trial/perception.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace turbidock::trial {

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
  world_.RenderImages(*Slot(number), number, whole ? std::nullopt : estimator_->RegionOfInterest(),
                      timer_, &latest_);
  seen_ = &latest_;
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
