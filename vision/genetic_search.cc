#include "vision/genetic_search.h"

#include <algorithm>
#include <cmath>

#include "sim/base/published.h"

namespace turbidock::vision {
namespace {

// Sizes of a small move are log-uniform between the least and one of the others: what a search may
// still be off by before and once the marker is found.
constexpr double kMinMove_m = 0.001, kMaxMove_m = 0.1, kMaxMoveFound_m = 0.02;
// Of a turn (eps) over the size: balls 70 mm from the pivot then move by 0.4 of it.
constexpr double kMoveEps_per_m = 3;

Gene RandomGene(Rng* rng) {
  Gene gene;
  for (uint16_t& field : gene.fields) field = static_cast<uint16_t>(rng->Below(kFieldMax + 1));
  return gene;
}

}  // namespace

GeneticSearch::GeneticSearch(const RmGaOptions& options, const MarkerParams& marker,
                             const Fitness* fitness)
    : options_(options),
      marker_(marker),
      fitness_(*fitness),
      kept_(static_cast<size_t>(
          std::clamp(static_cast<int>(std::lround(options.selection_rate * options.population)), 1,
                     options.population - 1))),
      range_(options.range),
      population_(static_cast<size_t>(options.population)),
      poses_(population_.size()),
      fitness_of_poses_(population_.size()) {}

void GeneticSearch::SearchIn(const GeneMap& range, const GeneMap::Values& motion) {
  for (Individual& individual : population_) {
    GeneMap::Values values = range_.Decode(individual.gene);
    for (size_t i = 0; i < kGeneFields; ++i) values[i] += motion[i];
    individual.gene = range.Encode(values);
  }
  range_ = range;
}

void GeneticSearch::Reinitialize(const GeneMap& range) {
  range_ = range;
  started_ = false;
}

void GeneticSearch::BeginFrame(bool restart, Rng* rng) {
  // The best is kept: in turbid water the right pose may be no better than that.
  const size_t first_new = !started_ ? 0 : restart ? 1 : population_.size();
  for (size_t i = first_new; i < population_.size(); ++i) population_[i].gene = RandomGene(rng);
  started_ = true;
  evaluations_ = 0;
  Evaluate(0, population_.size());
  Sort();
}

void GeneticSearch::Breed(int evaluations_left, Rng* rng) {
  const size_t end = population_.size() - static_cast<size_t>(evaluations_left);
  for (size_t i = kept_; i < end; ++i) population_[i].gene = Offspring(rng);
  Evaluate(kept_, end);
  Sort();
}

void GeneticSearch::Sort() {
  // Ties keep their order: as std::stable_sort, which would allocate.
  for (size_t i = 0; i < population_.size(); ++i) population_[i].place = static_cast<int>(i);
  std::sort(population_.begin(), population_.end(), [](const Individual& a, const Individual& b) {
    return a.fitness != b.fitness ? a.fitness > b.fitness : a.place < b.place;
  });
}

void GeneticSearch::Insert(const Pose& X_HM) {
  population_.back().gene = range_.Encode(GeneMap::ValuesOf(X_HM));
}

Pose GeneticSearch::best_X_HM() const {
  return GeneMap::PoseOf(range_.Decode(population_.front().gene));
}

// Evaluates the individuals [first, end).
void GeneticSearch::Evaluate(size_t first, size_t end) {
  const size_t count = end - first;
  for (size_t i = 0; i < count; ++i)
    poses_[i] = GeneMap::PoseOf(range_.Decode(population_[first + i].gene));
  fitness_.EvaluateAll(std::span(poses_).first(count), std::span(fitness_of_poses_).first(count));
  for (size_t i = 0; i < count; ++i) population_[first + i].fitness = fitness_of_poses_[i];
  evaluations_ += static_cast<int64_t>(count);
}

const Gene& GeneticSearch::Parent(Rng* rng) const {
  return population_[rng->Below(static_cast<uint32_t>(kept_))].gene;
}

Gene GeneticSearch::Offspring(Rng* rng) const {
  // The published setting draws nothing here, so that its random stream is crossover's and
  // mutation's.
  if (options_.local_mutation_rate > 0 && rng->Uniform() < options_.local_mutation_rate) {
    const bool is_found = population_.front().fitness >= published::kReliableFitness;
    return is_found ? Moved(population_.front().gene, kMaxMoveFound_m, rng)
                    : Moved(Parent(rng), kMaxMove_m, rng);
  }
  return ChildOfTwo(rng);
}

// A child of two: crossover and mutation, as published.
Gene GeneticSearch::ChildOfTwo(Rng* rng) const {
  const Gene& a = Parent(rng);
  const Gene& b = Parent(rng);
  const int cut = static_cast<int>(rng->Below(kGeneBits + 1));
  const int other = static_cast<int>(rng->Below(kGeneBits + 1));
  Gene child = Cross(a, b, std::min(cut, other), std::max(cut, other));
  // From one flipped bit to the next is a geometric step: one draw a flip, not one a bit.
  const double scale = 1 / std::log1p(-std::min(options_.mutation_rate, 1 - 1e-12));
  const auto unflipped = [&] {
    return static_cast<int>(std::min<double>(kGeneBits, scale * std::log1p(-rng->Uniform())));
  };
  for (int i = unflipped(); i < kGeneBits; i += 1 + unflipped()) child.FlipBit(i);
  return child;
}

// A small move of one individual.
Gene GeneticSearch::Moved(const Gene& parent, double most_m, Rng* rng) const {
  const double size_m = most_m * std::pow(kMinMove_m / most_m, rng->Uniform());
  GeneMap::Values v = range_.Decode(parent);
  // In depth along the line of sight, which keeps the place in the image, and three times as far as
  // sideways, because the images tell depth less well.
  const double stretch = std::max(0.1, 1 + 3 * size_m * rng->Normal() / v[0]);
  // The turn is about one of the balls, which keeps that ball where it is in the images.
  const Eigen::Vector3d& p_MQ =
      marker_.balls[rng->Below(static_cast<uint32_t>(marker_.balls.size()))].p_MQ_m;
  const Eigen::Vector3d p_HQ = GeneMap::PoseOf(v) * p_MQ;
  for (size_t i = 3; i < kGeneFields; ++i) v[i] += kMoveEps_per_m * size_m * rng->Normal();
  const Eigen::Vector3d p_HM = stretch * (p_HQ - GeneMap::PoseOf(v).q * p_MQ);
  v[0] = p_HM.x();
  v[1] = p_HM.y() + size_m * rng->Normal();
  v[2] = p_HM.z() + size_m * rng->Normal();
  return range_.Encode(v);
}

}  // namespace turbidock::vision
