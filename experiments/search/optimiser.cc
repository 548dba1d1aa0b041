#include "experiments/search/optimiser.h"

#include <map>
#include <memory>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/algorithms/nsga2.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "experiments/statistics/sampling.h"
#include "sim/base/check.h"
#include "sim/base/random.h"

namespace turbidock::search {
namespace {

constexpr double kUnknown = 1e30;  // what a candidate is worth before it was evaluated

// What pagmo's problem asks; shared by its copies.
struct Oracle {
  int generation = 0;
  int objectives = 1;
  bool collecting = false;
  std::vector<Candidate> wanted;     // while collecting: what was asked and is not known
  std::map<Candidate, Worth> known;  // of this generation
  const Evaluate* evaluate = nullptr;
};

struct Problem {
  std::shared_ptr<Oracle> oracle = std::make_shared<Oracle>();
  size_t dimensions = 1;

  pagmo::vector_double fitness(const pagmo::vector_double& x) const {
    if (const auto found = oracle->known.find(x); found != oracle->known.end())
      return found->second;
    if (oracle->collecting) {
      oracle->wanted.push_back(x);
      return Worth(static_cast<size_t>(oracle->objectives), kUnknown);
    }
    const Worth worth = (*oracle->evaluate)(oracle->generation, {x})[0];
    oracle->known[x] = worth;
    return worth;
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {Candidate(dimensions, 0.0), Candidate(dimensions, 1.0)};
  }
  pagmo::vector_double::size_type get_nobj() const {
    return static_cast<pagmo::vector_double::size_type>(oracle->objectives);
  }
  template <class Archive>
  void serialize(Archive&, unsigned) {}
};

pagmo::algorithm MakeAlgorithm(const OptimiserParams& params, unsigned seed) {
  // Of one generation a call, keeping what they have learnt; they never stop by themselves.
  constexpr unsigned kGenerations = 1;
  if (params.algorithm == Algorithm::kNsga2)
    return pagmo::algorithm(pagmo::nsga2(kGenerations, 0.95, 10, 0.05, 20, seed));
  return pagmo::algorithm(pagmo::cmaes(kGenerations, -1, -1, -1, -1, params.initial_step, 0, 0,
                                       /*memory=*/true, /*force_bounds=*/true, seed));
}

// The first population: the start, and for nsga2 others about the cube.
std::vector<Candidate> FirstPopulation(const OptimiserParams& params, uint64_t seed,
                                       const Candidate& start) {
  std::vector<Candidate> first = {start};
  if (params.algorithm == Algorithm::kCmaEs) return first;
  Rng rng = SeedTree(seed).Stream("tuning.population");
  const int others = params.population - 1;
  first.resize(static_cast<size_t>(params.population), Candidate(start.size()));
  for (size_t dimension = 0; dimension < start.size(); ++dimension) {
    const std::vector<double> column = statistics::StratifiedSamples(others, &rng);
    for (size_t i = 0; i < column.size(); ++i) first[i + 1][dimension] = column[i];
  }
  return first;
}

bool Beats(const Worth& a, const Worth& b) {
  bool better = false;
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i] > b[i]) return false;
    better |= a[i] < b[i];
  }
  return better;
}

}  // namespace

void OptimiserParams::Check(const std::string& path) const {
  if (algorithm == Algorithm::kNsga2 && population % 4 != 0)
    throw ConfigError(JoinKey(path, "population"),
                      std::to_string(population) + " must be a multiple of 4 for nsga2");
}

void Optimise(const OptimiserParams& params, uint64_t seed, const Candidate& start, int objectives,
              const Evaluate& evaluate, const std::function<bool()>& stop) {
  Problem problem;
  problem.dimensions = start.size();
  const std::shared_ptr<Oracle> oracle = problem.oracle;
  oracle->objectives = objectives;
  oracle->evaluate = &evaluate;
  Rng rng = SeedTree(seed).Stream("tuning.algorithm");
  pagmo::population population(pagmo::problem(problem), 0, rng.NextU32());
  const pagmo::algorithm algorithm = MakeAlgorithm(params, rng.NextU32());

  const std::vector<Candidate> first = FirstPopulation(params, seed, start);
  const std::vector<Worth> worths = evaluate(0, first);
  for (size_t i = 0; i < first.size(); ++i) population.push_back(first[i], worths[i]);
  // cma_es begins at the best of its population and replaces the rest without an evaluation.
  while (static_cast<int>(population.size()) < params.population)
    population.push_back(start, Worth(static_cast<size_t>(objectives), kUnknown));

  for (int generation = 1; generation <= params.generations; ++generation) {
    if (stop && stop()) return;
    oracle->generation = generation;
    oracle->known.clear();
    // A rehearsal on copies says which candidates the generation will ask for, because they do not
    // depend on each other's worth. Should one do so after all, it is evaluated when it is asked.
    oracle->wanted.clear();
    oracle->collecting = true;
    const pagmo::algorithm rehearsal = algorithm;
    rehearsal.evolve(population);
    oracle->collecting = false;
    const std::vector<Candidate> wanted = oracle->wanted;
    const std::vector<Worth> answers = evaluate(generation, wanted);
    for (size_t i = 0; i < wanted.size(); ++i) oracle->known[wanted[i]] = answers[i];
    population = algorithm.evolve(population);
  }
}

std::vector<size_t> ParetoFront(const std::vector<Worth>& worths) {
  std::vector<size_t> front;
  for (size_t i = 0; i < worths.size(); ++i) {
    bool beaten = false;
    for (size_t j = 0; j < worths.size() && !beaten; ++j) beaten = Beats(worths[j], worths[i]);
    if (!beaten) front.push_back(i);
  }
  return front;
}

}  // namespace turbidock::search
