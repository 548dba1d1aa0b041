#include "vision/genetic_search.h"

#include <algorithm>
#include <cmath>

namespace turbidock::vision {
namespace {

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

void GeneticSearch::Forget(const GeneMap& range) {
  range_ = range;
  started_ = false;
}

void GeneticSearch::BeginFrame(bool restart, Rng* rng) {
  const int population = size();
  int first_new = population;
  if (!started_) {
    first_new = 0;
  } else if (restart) {
    const int renewed = static_cast<int>(std::lround(options_.restart_fraction * population));
    first_new = std::max(population - renewed, options_.restart_keeps_best ? 1 : 0);
  }
  for (int i = first_new; i < population; ++i)
    population_[static_cast<size_t>(i)].gene = RandomGene(rng);
  started_ = true;
  if (suggested_X_HM_) population_.back().gene = range_.Encode(GeneMap::ValuesOf(*suggested_X_HM_));
  suggested_X_HM_.reset();

  evaluations_ = 0;
  Evaluate(0, population_.size());
  Sort();
}

void GeneticSearch::Breed(int spared, bool is_lost, Rng* rng) {
  Replace(size() - spared - kept(), spared, is_lost, rng);
  Sort();
}

void GeneticSearch::Replace(int count, int spared, bool is_lost, Rng* rng) {
  const size_t end = population_.size() - static_cast<size_t>(spared);
  const size_t first = end - static_cast<size_t>(count);
  for (size_t i = first; i < end; ++i) population_[i].gene = Offspring(is_lost, rng);
  Evaluate(first, end);
}

void GeneticSearch::Sort() {
  // Ties keep their order: as std::stable_sort, which would allocate.
  for (size_t i = 0; i < population_.size(); ++i) population_[i].place = static_cast<int>(i);
  std::sort(population_.begin(), population_.end(), [](const Individual& a, const Individual& b) {
    return a.fitness != b.fitness ? a.fitness > b.fitness : a.place < b.place;
  });
}

void GeneticSearch::TakeIn(const Pose& X_HM, double fitness) {
  population_.back() = {range_.Encode(GeneMap::ValuesOf(X_HM)), fitness, 0};
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
  const auto kept = static_cast<uint32_t>(kept_);
  uint32_t i = rng->Below(kept);
  if (options_.parent_choice == ParentChoice::kTournament) i = std::min(i, rng->Below(kept));
  return population_[i].gene;
}

Gene GeneticSearch::Offspring(bool is_lost, Rng* rng) const {
  // The published setting draws nothing here, so that its random stream is crossover's and
  // mutation's.
  const double shares = options_.immigrant_share + options_.creep_share;
  if (shares > 0) {
    const bool is_lost_now =
        is_lost || population_.front().fitness < options_.restart_below_fitness;
    const double kind = rng->Uniform();
    if (is_lost_now && kind < options_.immigrant_share) return RandomGene(rng);
    if (kind < shares) {
      const bool from_best = !is_lost_now && rng->Uniform() < options_.creep_from_best;
      return Crept(from_best ? population_.front().gene : Parent(rng), is_lost_now, rng);
    }
  }
  return Bred(rng);
}

// A child of two: crossover and mutation, as published.
Gene GeneticSearch::Bred(Rng* rng) const {
  const Gene& a = Parent(rng);
  const Gene& b = Parent(rng);
  const int cut = static_cast<int>(rng->Below(kGeneBits + 1));
  const int other = static_cast<int>(rng->Below(kGeneBits + 1));
  Gene child = Cross(a, b, std::min(cut, other), std::max(cut, other));
  if (options_.mutation_unit == MutationUnit::kBit) {
    // From one flipped bit to the next is a geometric step: one draw a flip, not one a bit.
    const double scale = 1 / std::log1p(-std::min(options_.mutation_rate, 1 - 1e-12));
    const auto unflipped = [&] {
      return static_cast<int>(std::min<double>(kGeneBits, scale * std::log1p(-rng->Uniform())));
    };
    for (int i = unflipped(); i < kGeneBits; i += 1 + unflipped()) child.FlipBit(i);
  } else if (rng->Uniform() < options_.mutation_rate) {
    child.FlipBit(static_cast<int>(rng->Below(kGeneBits)));
  }
  return child;
}

// A small move of one individual.
Gene GeneticSearch::Crept(const Gene& parent, bool is_lost, Rng* rng) const {
  const double largest_m = is_lost ? options_.creep_max_m : options_.creep_max_found_m;
  const double size_m = largest_m * std::pow(options_.creep_min_m / largest_m, rng->Uniform());
  GeneMap::Values v = range_.Decode(parent);
  // In depth along the line of sight, which keeps the place in the image, and three times as far as
  // sideways, because the images tell depth less well.
  const double stretch = std::max(0.1, 1 + 3 * size_m * rng->Normal() / v[0]);
  // The turn is about one of the balls, which keeps that ball where it is in the images.
  const Eigen::Vector3d& p_MQ =
      marker_.balls[rng->Below(static_cast<uint32_t>(marker_.balls.size()))].p_MQ_m;
  const Eigen::Vector3d p_HQ = GeneMap::PoseOf(v) * p_MQ;
  for (size_t i = 3; i < kGeneFields; ++i)
    v[i] += options_.creep_eps_per_m * size_m * rng->Normal();
  const Eigen::Vector3d p_HM = stretch * (p_HQ - GeneMap::PoseOf(v).q * p_MQ);
  v[0] = p_HM.x();
  v[1] = p_HM.y() + size_m * rng->Normal();
  v[2] = p_HM.z() + size_m * rng->Normal();
  return range_.Encode(v);
}

}  // namespace turbidock::vision
