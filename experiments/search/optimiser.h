#pragma once
// CMA-ES (Hansen 2006), as pagmo has it (Biscani and Izzo 2020, JOSS 5:2338), that asks for a
// generation at a time, so that its candidates can be evaluated side by side.

#include <cstdint>
#include <functional>
#include <vector>

#include "sim/base/fields.h"

namespace turbidock::search {

struct OptimiserParams {
  int population = 12;
  int generations = 20;
  double initial_step = 0.25;

  static void Fields(auto& self, auto&& field) {
    field("population", self.population, InRange(5, 1000), "number of candidates in a generation");
    field("generations", self.generations, InRange(0, 100000),
          "number of generations of candidates; 0 only evaluates the start");
    field("initial_step", self.initial_step, InRange(0.001, 1),
          "standard deviation of the first candidates about the start, as a share of each range");
  }
};

// A point of the unit cube.
using Candidate = std::vector<double>;

// The objective, which is minimised, of the candidates of a generation, in their order. Generation
// 0 is the start alone.
using Evaluate =
    std::function<std::vector<double>(int generation, const std::vector<Candidate>& candidates)>;

// Runs the budget. Everything follows from the settings, the seed and what Evaluate returns.
void Optimise(const OptimiserParams& params, uint64_t seed, const Candidate& start,
              const Evaluate& evaluate);

}  // namespace turbidock::search
