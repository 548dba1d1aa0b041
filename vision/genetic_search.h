#pragma once
// The genetic search: a population of poses, better from generation to generation, that goes on
// from one frame to the next.
//
// A frame begins with the evaluation of everyone on the new images. A generation keeps the best,
// replaces the rest by offspring of the kept and evaluates those; a kept individual's fitness on
// one frame's images is a constant, so it is not evaluated again.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/base/random.h"
#include "vision/fitness.h"
#include "vision/gene.h"
#include "vision/marker_model.h"
#include "vision/rm_ga_options.h"

namespace turbidock::vision {

class GeneticSearch {
 public:
  // Options must have been checked. `fitness` must outlive it.
  GeneticSearch(const RmGaOptions& options, const MarkerParams& marker, const Fitness* fitness);

  // Before a frame: searches another range from now on, the population moved by so much, ...
  void SearchIn(const GeneMap& range, const GeneMap::Values& motion);
  // ... or draws the whole population at random, in this range, when the frame begins.
  void Reinitialize(const GeneMap& range);

  // Evaluates the population on new images; `restart`: all but the best are drawn anew.
  void BeginFrame(bool restart, Rng* rng);
  // One generation. Evaluates so many less than it could; the worst stay then.
  void Breed(int evaluations_left, Rng* rng);
  // Takes this pose in place of the worst; the next frame evaluates it.
  void Insert(const Pose& X_HM);

  Pose best_X_HM() const;
  int size() const { return static_cast<int>(population_.size()); }
  int kept() const { return static_cast<int>(kept_); }  // by each generation
  int64_t evaluations() const { return evaluations_; }  // since the frame began

 private:
  struct Individual {
    Gene gene;
    double fitness = -1;
    int place = 0;  // before sorting, to break ties
  };

  void Evaluate(size_t first, size_t end);
  void Sort();
  const Gene& Parent(Rng* rng) const;
  Gene Offspring(Rng* rng) const;
  Gene ChildOfTwo(Rng* rng) const;
  Gene Moved(const Gene& parent, double most_m, Rng* rng) const;

  RmGaOptions options_;
  MarkerParams marker_;
  const Fitness& fitness_;
  size_t kept_;
  GeneMap range_;                       // what the genes mean
  std::vector<Individual> population_;  // best first
  std::vector<Pose> poses_;             // what is evaluated together
  std::vector<double> fitness_of_poses_;
  bool started_ = false;
  int64_t evaluations_ = 0;
};

}  // namespace turbidock::vision
