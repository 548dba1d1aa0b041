#include "vision/rm_ga.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace turbidock::vision {
namespace {

constexpr size_t kMostRefinements = 3;  // of one frame

// Options that passed their checks, for the members that are made from them.
const RmGaOptions& Checked(const RmGaOptions& options) {
  CheckFields(options, "estimator");
  return options;
}

void CheckSize(const Image3u8& image, const CameraIntrinsics& camera, const char* side) {
  if (image.width() == camera.width_px && image.height() == camera.height_px) return;
  const auto size = [](int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
  };
  throw ConfigError(std::string(side) + " image", size(image.width(), image.height()) +
                                                      " pixels, must be the rig's " +
                                                      size(camera.width_px, camera.height_px));
}

}  // namespace

RmGaOptions RmGaOptions::Published() {
  RmGaOptions options;
  options.preset = Preset::kPublished;
  options.generations_per_frame = 9;
  options.immigrant_share = 0;
  options.creep_share = 0;
  options.restart_after_frames = 0;
  options.swing_rad = 0;
  options.track.enabled = false;
  options.refine.enabled = false;
  return options;
}

void DetectionParams::Check(const std::string& path) const {
  if (off_fitness > on_fitness)
    throw ConfigError(path.empty() ? "off_fitness" : path + ".off_fitness",
                      FormatNumber(off_fitness) + ", must not exceed on_fitness (" +
                          FormatNumber(on_fitness) + ")");
}

void RmGaOptions::Check(const std::string& path) const {
  const auto fail = [&](const std::string& key, const std::string& problem) {
    throw ConfigError(path.empty() ? key : path + "." + key, problem);
  };
  if (immigrant_share + creep_share > 1)
    fail("creep_share", FormatNumber(creep_share) + " with immigrant_share " +
                            FormatNumber(immigrant_share) + ", must not exceed 1 together");
  if (creep_min_m > creep_max_m)
    fail("creep_max_m", FormatNumber(creep_max_m) + ", must be >= creep_min_m");
  if (creep_min_m > creep_max_found_m)
    fail("creep_max_found_m", FormatNumber(creep_max_found_m) + ", must be >= creep_min_m");
}

RmGa::RmGa(const RmGaOptions& options, const MarkerParams& marker, const HueParams& hue,
           const StereoRig& rig, Rng rng)
    : options_(Checked(options)),
      marker_(marker),
      rig_(rig),
      whole_{{0, 0, rig.left.width_px, rig.left.height_px},
             {0, 0, rig.right.width_px, rig.right.height_px}},
      rng_(rng),
      labeller_(hue, marker),
      left_labels_(rig.left.width_px, rig.left.height_px),
      right_labels_(rig.right.width_px, rig.right.height_px),
      fitness_(marker, rig, left_labels_, right_labels_),
      refiner_(options.refine, marker, rig),
      whole_range_(options.range),
      map_(options.range),
      kept_(std::clamp(static_cast<int>(std::lround(options.selection_rate * options.population)),
                       1, options.population - 1)),
      population_(static_cast<size_t>(options.population)),
      poses_(population_.size()),
      fitness_of_poses_(population_.size()) {
  estimate_.ball_fitness.resize(marker.balls.size());
}

void RmGa::Reset() {
  started_ = held_by_two_ = false;
  estimate_.covariance.reset();
  frames_lost_ = frames_found_ = frames_on_ = frames_off_ = 0;
  velocity_ = {};
  map_ = whole_range_;
  reach_.reset();
  estimate_.detected = false;
}

Gene RmGa::RandomGene() {
  Gene gene;
  for (uint16_t& field : gene.fields) field = static_cast<uint16_t>(rng_.Below(kFieldMax + 1));
  return gene;
}

const Gene& RmGa::Parent() {
  const auto kept = static_cast<uint32_t>(kept_);
  uint32_t i = rng_.Below(kept);
  if (options_.parent_choice == ParentChoice::kTournament) i = std::min(i, rng_.Below(kept));
  return population_[i].gene;
}

Gene RmGa::Bred() {
  const Gene& a = Parent();
  const Gene& b = Parent();
  const int cut = static_cast<int>(rng_.Below(kGeneBits + 1));
  const int other = static_cast<int>(rng_.Below(kGeneBits + 1));
  Gene child = Cross(a, b, std::min(cut, other), std::max(cut, other));
  if (options_.mutation_unit == MutationUnit::kBit) {
    // From one flipped bit to the next is a geometric step: one draw a flip, not one a bit.
    const double scale = 1 / std::log1p(-std::min(options_.mutation_rate, 1 - 1e-12));
    const auto unflipped = [&] {
      return static_cast<int>(std::min<double>(kGeneBits, scale * std::log1p(-rng_.Uniform())));
    };
    for (int i = unflipped(); i < kGeneBits; i += 1 + unflipped()) child.FlipBit(i);
  } else if (rng_.Uniform() < options_.mutation_rate) {
    child.FlipBit(static_cast<int>(rng_.Below(kGeneBits)));
  }
  return child;
}

Gene RmGa::Crept(const Gene& parent) {
  const double largest_m = is_lost() ? options_.creep_max_m : options_.creep_max_found_m;
  const double size_m = largest_m * std::pow(options_.creep_min_m / largest_m, rng_.Uniform());
  GeneMap::Values v = map_.Decode(parent);
  // In depth along the line of sight, which keeps the place in the image, and three times as far as
  // sideways, because the images tell depth less well.
  const double stretch = std::max(0.1, 1 + 3 * size_m * rng_.Normal() / v[0]);
  // The turn is about one of the balls, which keeps that ball where it is in the images.
  const Eigen::Vector3d& p_MQ =
      marker_.balls[rng_.Below(static_cast<uint32_t>(marker_.balls.size()))].p_MQ_m;
  const Eigen::Vector3d p_HQ = GeneMap::PoseOf(v) * p_MQ;
  for (size_t i = 3; i < kGeneFields; ++i)
    v[i] += options_.creep_eps_per_m * size_m * rng_.Normal();
  const Eigen::Vector3d p_HM = stretch * (p_HQ - GeneMap::PoseOf(v).q * p_MQ);
  v[0] = p_HM.x();
  v[1] = p_HM.y() + size_m * rng_.Normal();
  v[2] = p_HM.z() + size_m * rng_.Normal();
  return map_.Encode(v);
}

Gene RmGa::Offspring() {
  // The published setting draws nothing here, so that its random stream is crossover's and
  // mutation's.
  const double shares = options_.immigrant_share + options_.creep_share;
  if (shares > 0) {
    const double kind = rng_.Uniform();
    if (is_lost() && kind < options_.immigrant_share) return RandomGene();
    if (kind < shares) {
      const bool from_best = !is_lost() && rng_.Uniform() < options_.creep_from_best;
      return Crept(from_best ? population_.front().gene : Parent());
    }
  }
  return Bred();
}

// Evaluates the individuals [first, end).
void RmGa::Evaluate(size_t first, size_t end) {
  const size_t count = end - first;
  for (size_t i = 0; i < count; ++i)
    poses_[i] = GeneMap::PoseOf(map_.Decode(population_[first + i].gene));
  fitness_.EvaluateAll(std::span(poses_).first(count), std::span(fitness_of_poses_).first(count));
  for (size_t i = 0; i < count; ++i) population_[first + i].fitness = fitness_of_poses_[i];
  estimate_.evaluations += static_cast<int64_t>(count);
}

void RmGa::Sort() {
  // Ties keep their order: as std::stable_sort, which would allocate.
  for (size_t i = 0; i < population_.size(); ++i) population_[i].place = static_cast<int>(i);
  std::sort(population_.begin(), population_.end(), [](const Individual& a, const Individual& b) {
    return a.fitness != b.fitness ? a.fitness > b.fitness : a.place < b.place;
  });
}

void RmGa::PrepareForFrame() {
  const int population = options_.population;
  int first_new = population;
  if (!started_) {
    first_new = 0;
  } else if (options_.restart_after_frames > 0 && frames_lost_ >= options_.restart_after_frames) {
    const int renewed = static_cast<int>(std::lround(options_.restart_fraction * population));
    first_new = std::max(population - renewed, options_.restart_keeps_best ? 1 : 0);
    frames_lost_ = 0;
  }
  for (int i = first_new; i < population; ++i)
    population_[static_cast<size_t>(i)].gene = RandomGene();
  started_ = true;
  if (suggested_X_HM_) population_.back().gene = map_.Encode(GeneMap::ValuesOf(*suggested_X_HM_));
  suggested_X_HM_.reset();
}

const PoseEstimate& RmGa::Update(const StereoImage& seen) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = frame_time_s_ ? Clock::now() : Clock::time_point();
  const auto time_is_up = [&] {
    return std::chrono::duration<double>(Clock::now() - start).count() >= *frame_time_s_;
  };
  CheckSize(seen.left, rig_.left, "left");
  CheckSize(seen.right, rig_.right, "right");
  const StereoRegion& region = reach_ ? *reach_ : whole_;
  fitness_.Confine(region);
  labeller_.Label(seen.left, region.left, &left_labels_);
  labeller_.Label(seen.right, region.right, &right_labels_);
  Lap(timer(), LoopStage::kLabels);

  PrepareForFrame();
  estimate_.evaluations = 0;
  Evaluate(0, population_.size());
  Sort();
  const auto kept = static_cast<size_t>(kept_);
  const size_t refinements = !options_.refine.enabled ? 0
                             : held_by_two_ ? std::min(kMostRefinements, population_.size() - kept)
                                            : 1;
  generations_ = 0;
  for (bool last = false; !last;) {
    ++generations_;
    // The last one leaves the evaluations of refined poses.
    last = frame_time_s_ ? time_is_up() : generations_ == options_.generations_per_frame;
    const size_t end = population_.size() - (last ? refinements : 0);
    for (size_t i = kept; i < end; ++i) population_[i].gene = Offspring();
    Evaluate(kept, end);
    Sort();
  }

  const Pose last_X_HM = estimate_.X_HM;
  const bool was_detected = estimate_.detected;
  const std::optional<Pose> last_refined_X_HM =
      estimate_.covariance ? std::optional(last_X_HM) : std::nullopt;
  const int64_t budget = estimate_.evaluations + static_cast<int64_t>(refinements);
  Report(seen.frame);
  if (options_.refine.enabled && estimate_.fitness >= options_.detection.off_fitness)
    Refine(seen, last_refined_X_HM, refinements);
  SpendRest(static_cast<size_t>(budget - estimate_.evaluations));
  UpdateDetection();
  if (options_.track.enabled) PlanNextFrame(last_X_HM, was_detected);
  return estimate_;
}

// The search's best pose becomes the estimate.
void RmGa::Report(int64_t frame) {
  const Pose X_HM = GeneMap::PoseOf(map_.Decode(population_.front().gene));
  const FitnessByBall by_ball = fitness_.EvaluateByBall(X_HM);
  estimate_.frame = frame;
  estimate_.X_HM = X_HM.Canonical();
  estimate_.covariance.reset();
  estimate_.fitness = by_ball.fitness;
  for (int b = 0; b < fitness_.ball_count(); ++b)
    estimate_.ball_fitness[static_cast<size_t>(b)] = by_ball.ball(b);
  held_by_two_ = options_.swing_rad > 0 &&
                 std::ranges::count_if(estimate_.ball_fitness,
                                       [&](double ball) {
                                         return ball >= options_.restart_below_ball_fitness;
                                       }) == 2 &&
                 estimate_.ball_fitness.size() > 2;
}

// What refinement leaves of a frame's evaluations goes to the search, whose best may improve by it.
void RmGa::SpendRest(size_t evaluations) {
  if (evaluations == 0) return;
  const bool is_refined = estimate_.covariance.has_value();  // that pose is the last individual
  const size_t end = population_.size() - (is_refined ? 1 : 0);
  for (size_t i = end - evaluations; i < end; ++i) population_[i].gene = Offspring();
  Evaluate(end - evaluations, end);
  if (is_refined) return;
  Sort();
  Report(estimate_.frame);
}

void RmGa::UpdateDetection() {
  const double least_ball_fitness = *std::ranges::min_element(estimate_.ball_fitness);
  // A track has told two balls from three already: one that is then hidden does not end it.
  const bool is_ambiguous = !reach_ && least_ball_fitness < options_.restart_below_ball_fitness;
  const bool lost = estimate_.fitness < options_.restart_below_fitness || is_ambiguous;
  frames_lost_ = lost ? frames_lost_ + 1 : 0;
  frames_found_ = lost ? 0 : frames_found_ + 1;
  const DetectionParams& limits = options_.detection;
  frames_on_ = estimate_.fitness >= limits.on_fitness ? frames_on_ + 1 : 0;
  frames_off_ = estimate_.fitness < limits.off_fitness ? frames_off_ + 1 : 0;
  if (frames_on_ >= limits.on_frames) estimate_.detected = true;
  if (frames_off_ >= limits.off_frames) estimate_.detected = false;
}

// The two balls that are matched best stay where they are.
Pose RmGa::Swung(const Pose& X_HM) {
  size_t first = 0, second = 1;
  const std::vector<double>& match = estimate_.ball_fitness;
  if (match[second] > match[first]) std::swap(first, second);
  for (size_t b = 2; b < match.size(); ++b) {
    if (match[b] > match[first])
      second = std::exchange(first, b);
    else if (match[b] > match[second])
      second = b;
  }
  const Eigen::Vector3d& p_MQ = marker_.balls[first].p_MQ_m;
  const Eigen::Vector3d axis = (marker_.balls[second].p_MQ_m - p_MQ).normalized();
  const double turn_rad = rng_.Uniform(-options_.swing_rad, options_.swing_rad);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, axis));
  return X_HM * Pose{turn, p_MQ - turn * p_MQ};
}

// Moves the estimate to where the edges of the balls are, unless what is found there contradicts
// the search: then the edges were of something else.
void RmGa::Refine(const StereoImage& seen, const std::optional<Pose>& last_refined_X_HM,
                  size_t most) {
  constexpr double kLargestLoss = 0.25;  // of F; a hidden half of a ball costs up to 0.2
  constexpr double kLargestResidual_px = 1.0;
  std::array<Pose, kMostRefinements> starts{estimate_.X_HM};
  size_t count = 1;
  if (held_by_two_ && count < most) starts[count++] = Swung(estimate_.X_HM);
  if (held_by_two_ && count < most && last_refined_X_HM) starts[count++] = *last_refined_X_HM;
  std::optional<Refined> best;
  double best_fitness = estimate_.fitness - kLargestLoss;
  for (size_t i = 0; i < count; ++i) {
    const std::optional<Refined> refined =
        refiner_.Refine(seen, reach_ ? *reach_ : whole_, starts[i]);
    if (!refined || refined->residual_px > kLargestResidual_px) continue;
    const double fitness = fitness_.Evaluate(refined->X_HM);
    ++estimate_.evaluations;
    if (best ? fitness <= best_fitness : fitness < best_fitness) continue;
    best = refined;
    best_fitness = fitness;
  }
  if (!best) return;
  estimate_.X_HM = best->X_HM.Canonical();
  estimate_.covariance = best->covariance;
  // It takes part in the next frame's search in place of the worst.
  population_.back() = {map_.Encode(GeneMap::ValuesOf(estimate_.X_HM)), best_fitness, 0};
}

void RmGa::PlanNextFrame(const Pose& last_X_HM, bool was_detected) {
  const TrackParams& track = options_.track;
  const GeneMap::Values now = GeneMap::ValuesOf(estimate_.X_HM);
  const GeneMap::Values last = GeneMap::ValuesOf(last_X_HM);
  for (size_t i = 0; i < kGeneFields; ++i)
    velocity_[i] = was_detected && estimate_.detected
                       ? velocity_[i] + track.velocity_gain * (now[i] - last[i] - velocity_[i])
                       : 0;
  const bool was_narrow = reach_.has_value();
  const bool give_up =
      !estimate_.detected || frames_lost_ >= std::max(1, options_.restart_after_frames);
  const bool narrow = was_narrow ? !give_up : frames_found_ >= track.found_frames;
  if (!narrow) {
    if (was_narrow) SearchIn(whole_range_, {});
    reach_.reset();
    return;
  }
  GeneMap::Values next, half_width;
  for (size_t i = 0; i < kGeneFields; ++i) {
    next[i] = now[i] + velocity_[i];
    half_width[i] = i == 0 ? track.depth_ratio * now[0] : i < 3 ? track.lateral_m : track.eps;
  }
  SearchIn(whole_range_.Around(next, half_width), velocity_);
  reach_ = StereoRegion{ReachOf(rig_.left, rig_.X_HL), ReachOf(rig_.right, rig_.X_HR)};
}

// The population, moved, in the codes of another range.
void RmGa::SearchIn(const GeneMap& map, const GeneMap::Values& motion) {
  for (Individual& individual : population_) {
    GeneMap::Values values = map_.Decode(individual.gene);
    for (size_t i = 0; i < kGeneFields; ++i) values[i] += motion[i];
    individual.gene = map.Encode(values);
  }
  map_ = map;
}

PixelRegion RmGa::ReachOf(const CameraIntrinsics& camera, const Pose& X_HC) const {
  const GeneMap::Values &low = map_.low(), &high = map_.high();
  const Eigen::Vector3d low_m(low[0], low[1], low[2]), high_m(high[0], high[1], high[2]);
  GeneMap::Values middle;
  for (size_t i = 0; i < kGeneFields; ++i) middle[i] = 0.5 * (low[i] + high[i]);
  const Pose X_HM = GeneMap::PoseOf(middle);
  // The largest turn away from the middle: eps is half the rotation vector for small angles.
  const double turn_rad =
      2 * Eigen::Vector3d(high[3] - middle[3], high[4] - middle[4], high[5] - middle[5]).norm();
  const Pose X_CH = X_HC.Inverse();
  Eigen::Vector2d least(camera.width_px, camera.height_px), most(-1, -1);
  for (const BallParams& ball : marker_.balls) {
    const double arm_m = turn_rad * ball.p_MQ_m.norm();
    const Eigen::Vector3d offset = X_HM.q * ball.p_MQ_m;
    for (int corner = 0; corner < 8; ++corner) {
      Eigen::Vector3d p_HQ;
      for (int k = 0; k < 3; ++k)
        p_HQ[k] = offset[k] + (corner >> k & 1 ? high_m[k] + arm_m : low_m[k] - arm_m);
      const Eigen::Vector3d p_CQ = X_CH * p_HQ;
      if (p_CQ.z() < kNearestDepth_m) return {0, 0, camera.width_px, camera.height_px};
      const BallCircle circle = ProjectBall(camera, p_CQ, ball.radius_m);
      // The envelope, and what refinement looks at beyond the outline.
      const double extent_px =
          std::max(marker_.outer_ring_ratio * circle.radius_px,
                   circle.radius_px + std::max(options_.refine.least_reach_px,
                                               options_.refine.reach_ratio * circle.radius_px)) +
          2;
      const Eigen::Vector2d center(circle.u_px, circle.v_px);
      least = least.cwiseMin(center - Eigen::Vector2d::Constant(extent_px));
      most = most.cwiseMax(center + Eigen::Vector2d::Constant(extent_px));
    }
  }
  const auto inside = [](double px, int size) {
    return static_cast<int>(std::clamp(px, 0.0, static_cast<double>(size)));
  };
  return {inside(std::floor(least.x()), camera.width_px),
          inside(std::floor(least.y()), camera.height_px),
          inside(std::ceil(most.x()) + 1, camera.width_px),
          inside(std::ceil(most.y()) + 1, camera.height_px)};
}

}  // namespace turbidock::vision
