#include "experiments/studies/tuning/tuner.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>

#include "sim/base/check.h"

namespace turbidock::tuning {
namespace {

// Sets of seeds: the generations' count from here, the proof's are apart.
constexpr uint64_t kHeldOutSet = 1'000'001, kRobustnessSet = 1'000'002, kSensitivitySet = 1'000'003;
constexpr uint64_t kFirstFreshSet = 1, kFirstChallengeSet = 500'001;

double Sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}
double Mean(const std::vector<double>& values) {
  return Sum(values) / static_cast<double>(values.size());
}

std::vector<double> Costs(const Study& study, const std::vector<trial::TrialRecord>& records) {
  std::vector<double> costs;
  costs.reserve(records.size());
  for (const trial::TrialRecord& record : records) costs.push_back(Sum(study.CostsOf(record)));
  return costs;
}

TrialSummary Summarise(const Study& study, const std::vector<trial::TrialRecord>& records) {
  TrialSummary summary{.trials = std::ssize(records), .cost = Mean(Costs(study, records))};
  std::vector<double> times, y, z;
  for (const trial::TrialRecord& record : records) {
    if (!record.success()) continue;
    ++summary.successes;
    times.push_back(record.time_s);
    y.push_back(std::abs(record.final_error_true.y_m));
    z.push_back(std::abs(record.final_error_true.z_m));
  }
  summary.success = statistics::WilsonInterval(summary.successes, summary.trials);
  summary.time_s = statistics::Median(times);
  summary.error_y_m = statistics::Median(y);
  summary.error_z_m = statistics::Median(z);
  return summary;
}

Comparison Compare(const Study& study, const std::string& what, const Evaluation& start,
                   const Evaluation& tuned) {
  Comparison comparison{.what = what,
                        .start = Summarise(study, start.records),
                        .tuned = Summarise(study, tuned.records)};
  comparison.cost =
      statistics::ComparePairs(Costs(study, start.records), Costs(study, tuned.records));
  std::vector<double> start_s, tuned_s;
  for (size_t i = 0; i < start.records.size(); ++i) {
    const trial::TrialRecord &a = start.records[i], &b = tuned.records[i];
    comparison.only_start += a.success() && !b.success();
    comparison.only_tuned += b.success() && !a.success();
    if (!a.success() || !b.success()) continue;
    start_s.push_back(a.time_s);
    tuned_s.push_back(b.time_s);
  }
  comparison.time_s = statistics::ComparePairs(start_s, tuned_s);
  comparison.mcnemar_p = statistics::McNemarExactP(comparison.only_start, comparison.only_tuned);
  return comparison;
}

// Everything that happens between the optimiser's question and its answer.
class Tuning {
 public:
  Tuning(const Study& study, Evaluations* evaluations, const TuningOptions& options,
         TuningProgress* progress, TuningResult* result)
      : study_(study),
        settings_(study.settings()),
        evaluations_(*evaluations),
        options_(options),
        progress_(*progress),
        result_(*result) {
    result_.start = result_.tuned = study.start();
    Tell();
  }

  std::vector<search::Worth> Generation(int generation,
                                        const std::vector<search::Candidate>& candidates) {
    progress_.phase = fmt::format("generation {}", generation);
    progress_.share =
        static_cast<double>(generation) / std::max(1, settings_.optimiser.generations + 1);
    const bool fresh =
        settings_.fresh_seeds && settings_.optimiser.algorithm == search::Algorithm::kCmaEs;
    const farm::Plan plan = study_.TrialsOf(
        fresh && generation > 0 ? kFirstFreshSet + static_cast<uint64_t>(generation) : 0,
        study_.seeds());
    if (fresh || generation == 0) EvaluateIncumbent(plan);

    std::vector<Evaluations::Request> requests;
    requests.reserve(candidates.size());
    for (const search::Candidate& candidate : candidates)
      requests.push_back({.gains = study_.GainsAt(candidate)});
    if (generation == 0) requests.erase(requests.begin());  // the start is the incumbent
    std::vector<Evaluation> done = evaluations_.Run(
        progress_.phase, plan, requests,
        races() ? Evaluations::GoOn([&](const Evaluation& e) { return MayWin(e); }) : nullptr);
    if (generation == 0) done.insert(done.begin(), incumbent_);

    std::vector<search::Worth> worths;
    worths.reserve(done.size());
    for (const Evaluation& evaluation : done) worths.push_back(WorthOf(evaluation));
    if (pareto()) KeepFront(done, worths);
    Record(generation, plan, done, worths);
    return worths;
  }

  // The tuned gains against what was there before, in variations, and each gain on its own.
  void Prove() {
    const ProofParams& proof = settings_.proof;
    progress_.phase = "held out";
    progress_.share = 0;
    result_.held_out = RunBoth(kHeldOutSet, proof.held_out_seeds, proof.cameras, nullptr);
    Tell();
    if (proof.robustness_seeds > 0)
      for (const Variation& variation : Variations()) {
        progress_.phase = variation.name;
        progress_.share = static_cast<double>(result_.robustness.size()) /
                          static_cast<double>(Variations().size());
        result_.robustness.push_back(RunBoth(kRobustnessSet, proof.robustness_seeds,
                                             proof.robustness_cameras, variation.change));
        Tell();
      }
    if (proof.sensitivity_seeds > 0) MeasureSensitivity();
    result_.finished = true;
    Tell();
  }

 private:
  bool pareto() const { return settings_.optimiser.algorithm == search::Algorithm::kNsga2; }
  bool races() const { return settings_.racing.enabled && !pareto(); }

  void EvaluateIncumbent(const farm::Plan& plan) {
    incumbent_ =
        evaluations_.Run(progress_.phase + " incumbent", plan, {{.gains = result_.tuned}})[0];
    incumbent_costs_ = Costs(study_, incumbent_.records);
    if (result_.generations.empty()) RequireAStart();
  }

  void RequireAStart() const {
    if (settings_.start_may_fail || incumbent_.success_rate() > 0) return;
    std::map<std::string, int> failures;
    for (const trial::TrialRecord& record : incumbent_.records) ++failures[NameOf(record.failure)];
    std::string list;
    for (const auto& [failure, count] : failures)
      list += fmt::format("{}{} {}", list.empty() ? "" : ", ", count, failure);
    throw HopelessStart(fmt::format(
        "the starting gains fail in every one of {} trials ({}); for instance seed {}: {}. Give "
        "better ones, or set start_may_fail: true in the study",
        incumbent_.records.size(), list, incumbent_.records[0].seed, incumbent_.records[0].reason));
  }

  // What is missing in successes costs.
  double Penalty(const Evaluation& evaluation) const {
    return settings_.success_weight *
           std::max(0.0, settings_.success_at_least - evaluation.success_rate());
  }

  // Of a candidate given up: the incumbent's cost on all trials and the difference so far.
  search::Worth WorthOf(const Evaluation& evaluation) const {
    if (pareto()) {
      search::Worth worth(settings_.objective.size(), Penalty(evaluation));
      for (const trial::TrialRecord& record : evaluation.records) {
        const std::vector<double> costs = study_.CostsOf(record);
        for (size_t i = 0; i < worth.size(); ++i)
          worth[i] += costs[i] / static_cast<double>(evaluation.records.size());
      }
      return worth;
    }
    const std::vector<double> costs = Costs(study_, evaluation.records);
    const std::vector<double> same(incumbent_costs_.begin(),
                                   incumbent_costs_.begin() + std::ssize(costs));
    return {Mean(incumbent_costs_) + Mean(costs) - Mean(same) + Penalty(evaluation)};
  }

  // Racing's rule (RacingParams).
  bool MayWin(const Evaluation& so_far) const {
    const std::vector<double> costs = Costs(study_, so_far.records);
    const auto n = static_cast<double>(costs.size());
    std::vector<double> differences(costs.size());
    for (size_t i = 0; i < costs.size(); ++i) differences[i] = costs[i] - incumbent_costs_[i];
    const double mean = Mean(differences);
    if (mean <= 0) return true;
    double squares = 0;
    for (const double d : differences) squares += (d - mean) * (d - mean);
    const double error = std::sqrt(squares / (n - 1) / n);
    const auto total = static_cast<double>(incumbent_costs_.size());
    const double looks =
        std::max(1.0, std::ceil((total - settings_.racing.first) / settings_.racing.every));
    const double alpha = (1 - settings_.racing.confidence) / looks;
    return mean <= error * boost::math::quantile(
                               boost::math::complement(boost::math::students_t(n - 1), alpha));
  }

  void KeepFront(const std::vector<Evaluation>& done, const std::vector<search::Worth>& worths) {
    for (size_t i = 0; i < done.size(); ++i)
      result_.front.push_back(
          {.gains = done[i].gains, .worth = worths[i], .success = done[i].success_rate()});
    std::vector<search::Worth> all;
    for (const ParetoPoint& point : result_.front) all.push_back(point.worth);
    std::vector<ParetoPoint> front;
    for (const size_t i : search::ParetoFront(all)) front.push_back(result_.front[i]);
    result_.front = std::move(front);
  }

  // The best candidate takes the incumbent's place when it is better on these trials and on as many
  // new ones together: one set of seeds alone would prefer who is lucky on it. What it gains on the
  // new ones, when it does.
  std::optional<double> Challenge(int generation, const Evaluation& best) {
    const farm::Plan plan =
        study_.TrialsOf(kFirstChallengeSet + static_cast<uint64_t>(generation), study_.seeds());
    const std::vector<Evaluation> both =
        evaluations_.Run(fmt::format("challenge {}", generation), plan,
                         {{.gains = incumbent_.gains}, {.gains = best.gains}});
    const auto joined = [](Evaluation a, const Evaluation& b) {
      a.records.insert(a.records.end(), b.records.begin(), b.records.end());
      return a;
    };
    const auto cost = [this](const Evaluation& e) {
      return Mean(Costs(study_, e.records)) + Penalty(e);
    };
    if (cost(joined(best, both[1])) >= cost(joined(incumbent_, both[0]))) return {};
    return cost(both[0]) - cost(both[1]);
  }

  void Record(int generation, const farm::Plan& plan, const std::vector<Evaluation>& done,
              const std::vector<search::Worth>& worths) {
    std::vector<double> sums;
    sums.reserve(worths.size());
    for (const search::Worth& worth : worths) sums.push_back(Sum(worth));
    const auto best =
        static_cast<size_t>(std::min_element(sums.begin(), sums.end()) - sums.begin());
    GenerationRecord record{.generation = generation,
                            .candidates = static_cast<int>(std::ssize(done)),
                            .best = sums[best],
                            .median = statistics::Median(sums).value_or(0),
                            .incumbent = Sum(WorthOf(incumbent_)),
                            .incumbent_success = incumbent_.success_rate()};
    for (const Evaluation& evaluation : done) record.given_up += evaluation.given_up;
    record.gained = result_.generations.empty() ? 0 : result_.generations.back().gained;
    std::optional<double> gained;
    if (!done[best].given_up && sums[best] < record.incumbent &&
        done[best].gains != incumbent_.gains)
      gained = Challenge(generation, done[best]);
    if (gained) {
      record.replaced = true;
      record.gained += *gained;
      incumbent_ = done[best];
      incumbent_costs_ = Costs(study_, incumbent_.records);
      result_.tuned = incumbent_.gains;
    }
    TD_CHECK(std::ssize(incumbent_.records) == plan.trials(), "an incumbent ran every trial");
    record.trials = evaluations_.trials();
    record.gains = result_.tuned;
    progress_.best = Sum(WorthOf(incumbent_));
    progress_.best_success = incumbent_.success_rate();
    result_.generations.push_back(record);
    Tell();
  }

  // What was there before, then the tuned gains, on the same trials.
  Comparison RunBoth(uint64_t set, int seeds, bool cameras,
                     const std::function<void(trial::Scenario*)>& change) {
    const auto seen = [&](trial::Scenario* scenario) {
      if (cameras) scenario->pose_source = trial::PoseSource::kCameras;
      if (change) change(scenario);
    };
    const std::vector<Evaluation> before =
        evaluations_.Run(progress_.phase, study_.TrialsAgainst(set, seeds),
                         {{.gains = study_.against(), .change = seen}});
    const std::vector<Evaluation> tuned = evaluations_.Run(
        progress_.phase, study_.TrialsOf(set, seeds), {{.gains = result_.tuned, .change = seen}});
    return Compare(study_, progress_.phase, before[0], tuned[0]);
  }

  void MeasureSensitivity() {
    const ProofParams& proof = settings_.proof;
    const farm::Plan plan = study_.TrialsOf(kSensitivitySet, proof.sensitivity_seeds);
    progress_.phase = "sensitivity";
    progress_.share = 0;
    const auto costs = [&](const Evaluation& e) { return Costs(study_, e.records); };
    const std::vector<double> base =
        costs(evaluations_.Run("sensitivity", plan, {{.gains = result_.tuned}})[0]);
    const search::Candidate center = study_.CandidateOf(result_.tuned);
    for (size_t i = 0; i < center.size(); ++i) {
      progress_.share = static_cast<double>(i) / static_cast<double>(center.size());
      const auto moved = [&](double step) {
        search::Candidate candidate = center;
        candidate[i] = std::clamp(candidate[i] + step, 0.0, 1.0);
        return study_.GainsAt(candidate);
      };
      const std::string& key = settings_.gains[i].key;
      const std::vector<Evaluation> ends = evaluations_.Run(
          "sensitivity: " + key, plan,
          {{.gains = moved(-proof.sensitivity_step)}, {.gains = moved(proof.sensitivity_step)}});
      result_.sensitivity.push_back({.key = key,
                                     .down = ends[0].gains[i],
                                     .up = ends[1].gains[i],
                                     .cost_down = statistics::ComparePairs(base, costs(ends[0])),
                                     .cost_up = statistics::ComparePairs(base, costs(ends[1]))});
    }
  }

  void Tell() {
    result_.trials = evaluations_.trials();
    if (options_.on_result) options_.on_result(result_);
  }

  const Study& study_;
  const StudySettings& settings_;
  Evaluations& evaluations_;
  const TuningOptions& options_;
  TuningProgress& progress_;
  TuningResult& result_;
  Evaluation incumbent_;
  std::vector<double> incumbent_costs_;
};

// The common kind and those of individual thrusters.
void ForEachKind(vehicle::ThrusterParams* thrusters,
                 const std::function<void(vehicle::ThrusterKind*)>& change) {
  change(thrusters);
  for (vehicle::IndividualThruster& individual : thrusters->individual) change(&individual);
}

}  // namespace

TuningResult Tune(const Study& study, const std::string& file, const TuningOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  TuningResult result;
  TuningProgress progress;
  Evaluations evaluations(study, file,
                          {.farm = options.farm,
                           .trial_time_limit_s = study.TrialsOf(0, 1).settings().trial_time_limit_s,
                           .on_trial =
                               [&](int64_t trials) {
                                 progress.trials = trials;
                                 if (options.on_progress) options.on_progress(progress);
                               },
                           .stop_requested = options.stop_requested});
  Tuning tuning(study, &evaluations, options, &progress, &result);
  const uint64_t seed = static_cast<uint64_t>(study.TrialsOf(0, 1).settings().master_seed);
  search::Optimise(
      study.settings().optimiser, seed, study.CandidateOf(study.start()),
      study.settings().optimiser.algorithm == search::Algorithm::kNsga2
          ? static_cast<int>(std::ssize(study.settings().objective))
          : 1,
      [&](int generation, const std::vector<search::Candidate>& candidates) {
        return tuning.Generation(generation, candidates);
      },
      nullptr);
  tuning.Prove();
  result.trials_run = evaluations.progress().done_now;
  result.worker_time_s = evaluations.progress().worker_time_s;
  result.wall_time_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return result;
}

const std::vector<Variation>& Variations() {
  static const std::vector<Variation> variations = [] {
    std::vector<Variation> all = {{"as studied", [](trial::Scenario*) {}}};
    for (const double factor : {0.7, 1.3}) {
      const std::string sign = factor < 1 ? "-30 %" : "+30 %";
      // A heavier vehicle is trimmed with foam, or it would sink.
      all.push_back({"mass " + sign, [factor](trial::Scenario* s) {
                       s->vehicle.rigid_body.mass_kg *= factor;
                       s->vehicle.rigid_body.inertia_kg_m2 *= factor;
                       s->vehicle.hydrodynamics.displaced_volume_m3 *= factor;
                     }});
      all.push_back({"drag " + sign, [factor](trial::Scenario* s) {
                       s->vehicle.hydrodynamics.linear_damping_diagonal *= factor;
                       s->vehicle.hydrodynamics.quadratic_damping_diagonal *= factor;
                     }});
      all.push_back({"thruster gain " + sign, [factor](trial::Scenario* s) {
                       ForEachKind(&s->vehicle.thrusters, [factor](vehicle::ThrusterKind* kind) {
                         kind->max_thrust_newton *= factor;
                         for (double& newton : kind->table_thrust_newton) newton *= factor;
                       });
                     }});
      all.push_back({"thruster lag " + sign, [factor](trial::Scenario* s) {
                       ForEachKind(&s->vehicle.thrusters, [factor](vehicle::ThrusterKind* kind) {
                         kind->lag_s *= factor;
                       });
                     }});
    }
    for (const int frames : {0, 2, 3})
      all.push_back({fmt::format("camera delay {} frames", frames),
                     [frames](trial::Scenario* s) { s->camera_delay_frames = frames; }});
    for (const auto& [state, name] : EnumNames<vehicle::SeaState>::kNames)
      if (state != vehicle::SeaState::kCustom)
        all.push_back({std::string("sea ") + name,
                       [state = state](trial::Scenario* s) { s->sea.state = state; }});
    return all;
  }();
  return variations;
}

}  // namespace turbidock::tuning
