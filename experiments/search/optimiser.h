#pragma once
// Optimisers of pagmo (Biscani and Izzo 2020, JOSS 5:2338) that ask for a generation at a time, so
// that its candidates can be evaluated side by side.

#include <cstdint>
#include <functional>
#include <vector>

#include "sim/base/fields.h"

namespace turbidock::search {

enum class Algorithm {
  kCmaEs,  // covariance matrix adaptation (Hansen 2006)
  kNsga2,  // several objectives: a Pareto front (Deb et al. 2002)
};
constexpr auto Names(Algorithm) {
  using enum Algorithm;
  return EnumList<Algorithm>({{kCmaEs, "cma_es"}, {kNsga2, "nsga2"}});
}

struct OptimiserParams {
  Algorithm algorithm = Algorithm::kCmaEs;
  int population = 12;
  int generations = 20;
  double initial_step = 0.25;

  static void Fields(auto& self, auto&& field) {
    field("algorithm", self.algorithm, Finite(), "which");
    field("population", self.population, InRange(5, 1000), "candidates in a generation");
    field("generations", self.generations, InRange(0, 100000),
          "budget; 0 only evaluates the start");
    field("initial_step", self.initial_step, InRange(0.001, 1),
          "cma_es: standard deviation of the first generation about the start, in ranges");
  }
  void Check(const std::string& path) const;  // what an algorithm needs of its population
};

// A point of the unit cube and its objective values, which are minimised.
using Candidate = std::vector<double>;
using Worth = std::vector<double>;

// Evaluates the candidates of a generation, in order. Generation 0 is the start (and for nsga2 a
// first population spread about the cube).
using Evaluate =
    std::function<std::vector<Worth>(int generation, const std::vector<Candidate>& candidates)>;

// Runs the budget, or until `stop`, which is asked between generations. Everything follows from the
// settings, the seed and what Evaluate returns.
void Optimise(const OptimiserParams& params, uint64_t seed, const Candidate& start, int objectives,
              const Evaluate& evaluate, const std::function<bool()>& stop);

// Indices of the worths that no other one beats in every objective, in order.
std::vector<size_t> ParetoFront(const std::vector<Worth>& worths);

}  // namespace turbidock::search
