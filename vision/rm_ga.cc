#include "vision/rm_ga.h"

#include <algorithm>
#include <cmath>

namespace turbidock::vision {
namespace {

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
  options.generations_per_frame = 9;
  options.immigrant_share = 0;
  options.creep_share = 0;
  options.restart_after_frames = 0;
  return options;
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
      rig_(rig),
      rng_(rng),
      labeller_(hue, marker),
      left_labels_(rig.left.width_px, rig.left.height_px),
      right_labels_(rig.right.width_px, rig.right.height_px),
      fitness_(marker, rig, left_labels_, right_labels_),
      map_(options.range),
      kept_(std::clamp(static_cast<int>(std::lround(options.selection_rate * options.population)),
                       1, options.population - 1)),
      population_(static_cast<size_t>(options.population)) {
  for (const BallParams& ball : marker.balls) p_MQ_m_.push_back(ball.p_MQ_m);
  estimate_.ball_fitness.resize(marker.balls.size());
}

void RmGa::Reset() {
  started_ = false;
  frames_lost_ = 0;
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
    for (int i = 0; i < kGeneBits; ++i)
      if (rng_.Uniform() < options_.mutation_rate) child.FlipBit(i);
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
  const Eigen::Vector3d& p_MQ = p_MQ_m_[rng_.Below(static_cast<uint32_t>(p_MQ_m_.size()))];
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

void RmGa::Evaluate(Individual* individual) {
  individual->fitness = fitness_.Evaluate(GeneMap::PoseOf(map_.Decode(individual->gene)));
  ++estimate_.evaluations;
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
}

const PoseEstimate& RmGa::Update(const StereoImage& seen) {
  CheckSize(seen.left, rig_.left, "left");
  CheckSize(seen.right, rig_.right, "right");
  labeller_.Label(seen.left, &left_labels_);
  labeller_.Label(seen.right, &right_labels_);
  Lap(timer(), LoopStage::kLabels);

  PrepareForFrame();
  estimate_.evaluations = 0;
  for (Individual& individual : population_) Evaluate(&individual);
  Sort();
  for (int generation = 0; generation < options_.generations_per_frame; ++generation) {
    for (size_t i = static_cast<size_t>(kept_); i < population_.size(); ++i) {
      population_[i].gene = Offspring();
      Evaluate(&population_[i]);
    }
    Sort();
  }

  const Pose X_HM = GeneMap::PoseOf(map_.Decode(population_.front().gene));
  const FitnessByBall by_ball = fitness_.EvaluateByBall(X_HM);
  estimate_.frame = seen.frame;
  estimate_.X_HM = X_HM.Canonical();
  estimate_.fitness = by_ball.fitness;
  for (int b = 0; b < fitness_.ball_count(); ++b)
    estimate_.ball_fitness[static_cast<size_t>(b)] = by_ball.ball(b);
  frames_lost_ = estimate_.fitness < options_.restart_below_fitness ? frames_lost_ + 1 : 0;
  return estimate_;
}

}  // namespace turbidock::vision
