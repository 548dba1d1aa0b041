#include "experiments/studies/estimators/pagmo_estimator.h"

#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/algorithms/de.hpp>
#include <pagmo/algorithms/pso.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <vector>

#include "sim/base/check.h"
#include "vision/fitness.h"
#include "vision/rm_ga.h"

namespace turbidock::estimators {
namespace {

using Values = vision::GeneMap::Values;

// The search range as a unit cube, so that one step size suits position and rotation.
struct PoseProblem {
  const vision::Fitness* of = nullptr;
  Values low{}, high{};

  Pose PoseAt(const pagmo::vector_double& x) const {
    Values values;
    for (size_t i = 0; i < values.size(); ++i) values[i] = low[i] + (high[i] - low[i]) * x[i];
    return vision::GeneMap::PoseOf(values);
  }
  // These two are what pagmo asks for.
  pagmo::vector_double fitness(const pagmo::vector_double& x) const {
    return {-of->Evaluate(PoseAt(x))};
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {pagmo::vector_double(vision::kGeneFields, 0),
            pagmo::vector_double(vision::kGeneFields, 1)};
  }
};

pagmo::algorithm MakeAlgorithm(PagmoMethod method, unsigned generations, unsigned seed) {
  switch (method) {
    case PagmoMethod::kDe:  // F and CR as pagmo has them
      return pagmo::algorithm(pagmo::de(generations, 0.8, 0.9, 2, 0, 0, seed));
    case PagmoMethod::kPso:  // velocities are kept from frame to frame
      return pagmo::algorithm(
          pagmo::pso(generations, 0.7298, 2.05, 2.05, 0.5, 5, 2, 4, /*memory=*/true, seed));
    case PagmoMethod::kCmaes:  // so are covariance and step size
      return pagmo::algorithm(pagmo::cmaes(generations, -1, -1, -1, -1, 0.3, 0, 0,
                                           /*memory=*/true, /*force_bounds=*/true, seed));
  }
  TD_CHECK(false, "a method");
}

class PagmoEstimator : public vision::PoseEstimator {
 public:
  PagmoEstimator(const PagmoOptions& options, const vision::MarkerParams& marker,
                 const vision::HueParams& hue, const StereoRig& rig, uint32_t seed)
      : options_(options),
        seed_(seed),
        labeller_(hue, marker),
        fitness_(marker, rig, labels_),
        algorithm_(MakeAlgorithm(options.method, Generations(options), seed)) {
    const vision::GeneMap map(options.range);
    problem_ = {&fitness_, map.low(), map.high()};
    estimate_.ball_fitness.resize(marker.balls.size());
  }

  const PoseEstimate& Update(const StereoImage& seen) override {
    for (const Side side : kSides) labeller_.Label(seen[side], &labels_[side]);
    Lap(timer(), LoopStage::kLabels);
    // The last frame's individuals, evaluated on this one's images.
    const auto population_size = static_cast<size_t>(options_.population);
    pagmo::population population(pagmo::problem(problem_),
                                 individuals_.empty() ? population_size : 0, seed_);
    for (const pagmo::vector_double& x : individuals_) population.push_back(x);
    population = algorithm_.evolve(population);
    individuals_ = population.get_x();
    const Pose X_HM = problem_.PoseAt(population.champion_x());
    const vision::FitnessByBall by_ball = fitness_.EvaluateByBall(X_HM);
    estimate_.frame = seen.frame;
    estimate_.X_HM = X_HM.Canonical();
    estimate_.fitness = by_ball.fitness;
    for (int b = 0; b < fitness_.ball_count(); ++b)
      estimate_.ball_fitness[static_cast<size_t>(b)] = by_ball.ball(b);
    estimate_.evaluations = static_cast<int64_t>(population.get_problem().get_fevals());
    estimate_.detected = estimate_.fitness >= vision::Detection::kOnFitness;
    return estimate_;
  }
  void Reset() override {
    individuals_.clear();
    algorithm_ = MakeAlgorithm(options_.method, Generations(options_), seed_);
  }
  std::string_view name() const override { return NameOf(options_.method); }

 private:
  // One generation's evaluations go to the last frame's individuals.
  static unsigned Generations(const PagmoOptions& options) {
    return static_cast<unsigned>(options.evaluations_per_frame / options.population - 1);
  }

  PagmoOptions options_;
  uint32_t seed_;
  vision::HueLabeller labeller_;
  Stereo<Image1u8> labels_;
  vision::Fitness fitness_;
  PoseProblem problem_;
  pagmo::algorithm algorithm_;
  std::vector<pagmo::vector_double> individuals_;
  PoseEstimate estimate_;
};

}  // namespace

std::unique_ptr<vision::PoseEstimator> MakePagmoEstimator(const PagmoOptions& options,
                                                          const vision::MarkerParams& marker,
                                                          const vision::HueParams& hue,
                                                          const StereoRig& rig, uint32_t seed) {
  return std::make_unique<PagmoEstimator>(options, marker, hue, rig, seed);
}

}  // namespace turbidock::estimators
