#include "experiments/studies/tuning/tuner.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>
#include <numeric>

namespace turbidock::tuning {
namespace {

// Sets of seeds: the generations' are the first.
constexpr uint64_t kFirstChallengeSet = 500'001, kHeldOutSet = 1'000'001;

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
  TrialSummary summary{.trials = std::ssize(records), .cost_mean = Mean(Costs(study, records))};
  summary.cost_by_term.resize(study.settings().objective.size());
  std::vector<double> times, y, z;
  for (const trial::TrialRecord& record : records) {
    const std::vector<double> costs = study.CostsOf(record);
    for (size_t i = 0; i < costs.size(); ++i)
      summary.cost_by_term[i] += costs[i] / static_cast<double>(records.size());
    if (!record.success()) continue;
    ++summary.successes;
    times.push_back(record.time_s);
    y.push_back(std::abs(record.final_error_true.y_m));
    z.push_back(std::abs(record.final_error_true.z_m));
  }
  summary.success_95 = statistics::WilsonInterval(summary.successes, summary.trials);
  summary.time_s_median = statistics::Median(times);
  summary.final_error_true_y_m_median = statistics::Median(y);
  summary.final_error_true_z_m_median = statistics::Median(z);
  return summary;
}

Comparison Compare(const Study& study, const Evaluation& start, const Evaluation& tuned) {
  Comparison result{.start = Summarise(study, start.records),
                    .tuned = Summarise(study, tuned.records)};
  result.cost_difference =
      statistics::ComparePairs(Costs(study, start.records), Costs(study, tuned.records));
  std::vector<double> start_s, tuned_s;
  for (size_t i = 0; i < start.records.size(); ++i) {
    const trial::TrialRecord &a = start.records[i], &b = tuned.records[i];
    result.only_start_docked += a.success() && !b.success();
    result.only_tuned_docked += b.success() && !a.success();
    if (!a.success() || !b.success()) continue;
    start_s.push_back(a.time_s);
    tuned_s.push_back(b.time_s);
  }
  result.time_difference_s = statistics::ComparePairs(start_s, tuned_s);
  result.mcnemar_p = statistics::McNemarExactP(result.only_start_docked, result.only_tuned_docked);
  return result;
}

// Everything that happens between the optimiser's question and its answer.
class Tuning {
 public:
  Tuning(const Study& study, const std::string& file, const TuningOptions& options)
      : study_(study),
        settings_(study.settings()),
        options_(options),
        evaluations_(study, file,
                     {.jobs = options.jobs,
                      .time_limit_s = study.TrialsOf(0, 1).settings().trial_time_limit_s,
                      .plugins = study.plugins(),
                      .on_progress =
                          [this](const batch::RunProgress&) {
                            if (options_.on_progress)
                              options_.on_progress(phase_, share_, evaluations_.trials());
                          },
                      .stop_requested = options.stop_requested}) {}

  TuningResult Run() {
    result_.start = result_.tuned = study_.start();
    Tell();
    search::Optimise(settings_.optimiser, study_.master_seed(), study_.CandidateOf(study_.start()),
                     [this](int generation, const std::vector<search::Candidate>& candidates) {
                       return Generation(generation, candidates);
                     });
    // The tuned gains against those that were there before, on the same trials.
    const ProofParams& proof = settings_.proof;
    phase_ = "held out";
    share_ = 0;
    const std::vector<Evaluation> both =
        evaluations_.Run(phase_, study_.TrialsOf(kHeldOutSet, proof.held_out_seeds),
                         {study_.start(), result_.tuned}, proof.cameras);
    result_.held_out = Compare(study_, both[0], both[1]);
    result_.finished = true;
    const batch::RunProgress& progress = evaluations_.progress();
    result_.trials_run = progress.done_now;
    result_.worker_time_s = progress.worker_time_s;
    result_.wall_time_s = progress.wall_time_s;
    Tell();
    return result_;
  }

 private:
  // Costs of the candidates. All of them run the same trials as the incumbent, of seeds of their
  // own in every generation.
  std::vector<double> Generation(int generation, const std::vector<search::Candidate>& candidates) {
    phase_ = fmt::format("generation {}", generation);
    share_ = static_cast<double>(generation) / (settings_.optimiser.generations + 1);
    const auto set = static_cast<uint64_t>(generation == 0 ? 0 : generation + 1);
    const batch::Plan plan = study_.TrialsOf(set, study_.seeds());
    incumbent_ = evaluations_.Run(phase_ + " incumbent", plan, {result_.tuned})[0];
    incumbent_costs_ = Costs(study_, incumbent_.records);
    std::vector<Evaluation> done = {incumbent_};
    if (generation == 0) {
      RequireAStart();  // which is the incumbent
    } else {
      std::vector<Gains> gains;
      gains.reserve(candidates.size());
      for (const search::Candidate& c : candidates) gains.push_back(study_.GainsAt(c));
      Evaluations::GoOn go_on;
      if (settings_.racing.enabled) go_on = [this](const Evaluation& e) { return MayWin(e); };
      done = evaluations_.Run(phase_, plan, gains, false, go_on);
    }
    std::vector<double> costs;
    costs.reserve(done.size());
    for (const Evaluation& evaluation : done) costs.push_back(CostOf(evaluation));
    Record(generation, done, costs);
    return costs;
  }

  void RequireAStart() const {
    if (settings_.start_may_fail || incumbent_.success_rate() > 0) return;
    std::map<std::string, int> failures;
    for (const trial::TrialRecord& record : incumbent_.records) ++failures[NameOf(record.failure)];
    std::vector<std::string> list;
    list.reserve(failures.size());
    for (const auto& [failure, count] : failures)
      list.push_back(fmt::format("{} {}", count, failure));
    throw ConfigError(fmt::format(
        "the starting gains fail in every one of {} trials ({}); for instance seed {}: {}. Give "
        "better ones, or set start_may_fail: true in the study",
        incumbent_.records.size(), fmt::join(list, ", "), incumbent_.records[0].seed,
        incumbent_.records[0].reason));
  }

  // What is missing in successes costs.
  double Penalty(const Evaluation& evaluation) const {
    return settings_.success_weight *
           std::max(0.0, settings_.success_at_least - evaluation.success_rate());
  }

  // Of a candidate given up: the incumbent's cost on all trials and the difference so far.
  double CostOf(const Evaluation& evaluation) const {
    const std::vector<double> costs = Costs(study_, evaluation.records);
    const std::vector<double> same(incumbent_costs_.begin(),
                                   incumbent_costs_.begin() + std::ssize(costs));
    return Mean(incumbent_costs_) + Mean(costs) - Mean(same) + Penalty(evaluation);
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

  // The best candidate takes the incumbent's place when it is better on these trials and on as many
  // new ones together: one set of seeds alone would prefer who is lucky on it. What it gains on the
  // new ones, when it does.
  std::optional<double> Challenge(int generation, const Evaluation& best) {
    const batch::Plan plan =
        study_.TrialsOf(kFirstChallengeSet + static_cast<uint64_t>(generation), study_.seeds());
    const std::vector<Evaluation> both = evaluations_.Run(fmt::format("challenge {}", generation),
                                                          plan, {incumbent_.gains, best.gains});
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

  void Record(int generation, const std::vector<Evaluation>& done,
              const std::vector<double>& costs) {
    const auto best =
        static_cast<size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
    GenerationRecord record{.generation = generation,
                            .candidates = static_cast<int>(std::ssize(done)),
                            .best = costs[best],
                            .median = statistics::Median(costs).value_or(0),
                            .incumbent = CostOf(incumbent_),
                            .incumbent_success = incumbent_.success_rate(),
                            .incumbent_trials = Summarise(study_, incumbent_.records)};
    for (const Evaluation& evaluation : done) record.given_up += evaluation.given_up;
    if (!result_.generations.empty()) record.gained = result_.generations.back().gained;
    std::optional<double> gained;
    if (!done[best].given_up && costs[best] < record.incumbent &&
        done[best].gains != incumbent_.gains)
      gained = Challenge(generation, done[best]);
    if (gained) {
      record.replaced = true;
      record.gained += *gained;
      result_.tuned = done[best].gains;
    }
    record.trials = evaluations_.trials();
    record.gains = result_.tuned;
    result_.generations.push_back(record);
    Tell();
  }

  void Tell() {
    result_.trials = evaluations_.trials();
    if (options_.on_result) options_.on_result(result_);
  }

  const Study& study_;
  const StudySettings& settings_;
  const TuningOptions& options_;
  std::string phase_;
  double share_ = 0;
  Evaluations evaluations_;
  TuningResult result_;
  Evaluation incumbent_;
  std::vector<double> incumbent_costs_;
};

}  // namespace

TuningResult Tune(const Study& study, const std::string& file, const TuningOptions& options) {
  return Tuning(study, file, options).Run();
}

}  // namespace turbidock::tuning
