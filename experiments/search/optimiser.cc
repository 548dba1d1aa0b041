#include "experiments/search/optimiser.h"

#include <map>
#include <memory>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "sim/base/check.h"
#include "sim/base/random.h"

namespace turbidock::search {
namespace {

constexpr double kUnknown = 1e30;  // the objective of what was not evaluated

// What the objective was of the candidates of a generation, and which it was asked of without being
// known. Shared by the copies that pagmo makes of a problem.
struct Generation {
  std::map<Candidate, double> known;
  std::vector<Candidate> wanted;
};

struct Problem {
  std::shared_ptr<Generation> generation = std::make_shared<Generation>();
  size_t dimensions = 1;

  pagmo::vector_double fitness(const pagmo::vector_double& x) const {
    if (const auto found = generation->known.find(x); found != generation->known.end())
      return {found->second};
    generation->wanted.push_back(x);
    return {kUnknown};
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {Candidate(dimensions, 0.0), Candidate(dimensions, 1.0)};
  }
  template <class Archive>
  void serialize(Archive&, unsigned) {}
};

}  // namespace

void Optimise(const OptimiserParams& params, uint64_t seed, const Candidate& start,
              const Evaluate& evaluate) {
  Problem problem;
  problem.dimensions = start.size();
  Rng rng = SeedTree(seed).Stream("tuning.algorithm");
  pagmo::population population(pagmo::problem(problem), 0, rng.NextU32());
  // One generation a call, keeping what it has learnt; it never stops by itself.
  const pagmo::algorithm algorithm(pagmo::cmaes(1, -1, -1, -1, -1, params.initial_step, 0, 0,
                                                /*memory=*/true, /*force_bounds=*/true,
                                                rng.NextU32()));
  population.push_back(start, {evaluate(0, {start})[0]});
  // It begins at the best of its population and replaces the rest without an evaluation.
  while (static_cast<int>(population.size()) < params.population)
    population.push_back(start, {kUnknown});

  for (int generation = 1; generation <= params.generations; ++generation) {
    // A rehearsal on copies says which candidates the generation will ask for, because they do not
    // depend on each other's objective.
    *problem.generation = {};
    const pagmo::algorithm rehearsal = algorithm;
    rehearsal.evolve(population);
    const std::vector<Candidate> wanted = problem.generation->wanted;
    const std::vector<double> answers = evaluate(generation, wanted);
    for (size_t i = 0; i < wanted.size(); ++i) problem.generation->known[wanted[i]] = answers[i];
    population = algorithm.evolve(population);
    TD_CHECK(problem.generation->wanted.size() == wanted.size(), "the rehearsal was the same");
  }
}

}  // namespace turbidock::search
