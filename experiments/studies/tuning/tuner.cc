#include "experiments/studies/tuning/tuner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "experiments/system/build_info.h"

namespace turbidock::tuning {
namespace {

// Sets of seeds: the generations' are the first.
constexpr uint64_t kFirstChallengeSet = 500'001, kHeldOutSet = 1'000'001;
constexpr const char* kPhaseKey = "phase";

double Sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}
double Mean(const std::vector<double>& values) {
  return Sum(values) / static_cast<double>(values.size());
}

// One candidate's trials on one set of seeds, cell by cell in turn: fewer than asked for where it
// was given up.
struct Evaluation {
  Gains gains;
  std::vector<trial::TrialRecord> records{};
  std::vector<double> costs{};
  bool given_up = false;

  double success_rate() const {
    const auto successes = std::ranges::count_if(records, &trial::TrialRecord::success);
    return static_cast<double>(successes) / static_cast<double>(records.size());
  }
  std::vector<int64_t> seeds() const {
    std::vector<int64_t> seeds;
    for (const trial::TrialRecord& record : records) seeds.push_back(record.seed);
    return seeds;
  }
};

// Of both, one after the other.
Evaluation Joined(Evaluation a, const Evaluation& b) {
  a.records.insert(a.records.end(), b.records.begin(), b.records.end());
  a.costs.insert(a.costs.end(), b.costs.begin(), b.costs.end());
  return a;
}

HeldOut Compare(const Study& study, const Evaluation& start, const Evaluation& tuned) {
  batch::PairedTrials pairs;
  for (size_t i = 0; i < start.records.size(); ++i)
    pairs.Add(batch::TrialOf(start.records[i]), batch::TrialOf(tuned.records[i]));
  HeldOut result{
      .cost_difference = statistics::ComparePairs(start.costs, tuned.costs, start.seeds()),
      .terms = {},
      .changes = pairs.Changes("all")};
  batch::MarkSignificant(&result.changes);
  const std::vector<ObjectiveTerm>& objective = study.settings().objective;
  for (size_t i = 0; i < objective.size(); ++i) {
    const auto mean = [&](const Evaluation& of) {
      double sum = 0;
      for (const trial::TrialRecord& record : of.records) sum += study.CostsOf(record)[i];
      return sum / static_cast<double>(of.records.size());
    };
    result.terms.push_back({objective[i].metric, mean(start), mean(tuned)});
  }
  return result;
}

// ------------------------------------------------------------------------------------- evaluations

batch::StoreHeader HeaderOf(const Study& study) {
  batch::StoreHeader header{.kind = "tune",
                            .plan = study.resolved(),
                            .build = system::BuildId(),
                            .code = study.plan().code(),
                            .shard = {},
                            .trials = 0,
                            .keys = study.plan().keys()};
  header.keys.insert(header.keys.begin(), kPhaseKey);
  for (const GainRange& gain : study.settings().gains) header.keys.push_back(gain.key);
  return header;
}

batch::ResultStore OpenStore(const Study& study, const std::string& file, bool anew) {
  const batch::StoreHeader header = HeaderOf(study);
  if (!anew) return batch::ResultStore::Write(file, header);
  batch::ResultStore store = batch::ResultStore::Open(file, header);
  if (!batch::DifferenceOf(store.header(), header).empty()) store.Become(header, {});
  return store;
}

// The trials of a plan in the order in which they are run: cell by cell in turn, so that any
// beginning of them is fair.
std::vector<int64_t> FairOrder(const batch::Plan& plan) {
  std::vector<int64_t> order(static_cast<size_t>(plan.trials()));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int64_t trial) { return plan.Trial(trial).sample; });
  return order;
}

// Runs the trials of candidates in worker processes and keeps every one of them. Numbers follow
// from the study alone, so that a run that is started again finds its trials: what is asked for
// must depend on nothing else.
class Evaluations {
 public:
  Evaluations(const Study& study, const std::string& file, bool anew,
              const batch::RunOptions& options)
      : study_(study),
        file_(file),
        store_(OpenStore(study, file, anew)),
        runner_(options, &store_) {}

  // Decides after some of the trials whether to go on; asked at racing's looks only.
  using GoOn = std::function<bool(const Evaluation& so_far)>;

  // Evaluates gains side by side, through the cameras whatever the study says if `cameras`. `phase`
  // names what for in the file. Stopped when asked to.
  std::vector<Evaluation> Run(const std::string& phase, const batch::Plan& plan,
                              const std::vector<Gains>& candidates, bool cameras = false,
                              const GoOn& go_on = nullptr) {
    // Whose records are those up to the next look.
    struct Running {
      Evaluation evaluation;
      size_t asked = 0, done = 0;
      bool ended = false;
    };
    const std::vector<int64_t> order = FairOrder(plan);
    const RacingParams& racing = study_.settings().racing;
    const auto first = go_on ? static_cast<size_t>(racing.first) : order.size();
    // All trials of a candidate have a number, also those that racing leaves out.
    const int64_t first_evaluation = evaluations_, first_number = numbers_, of_each = plan.trials();
    evaluations_ += std::ssize(candidates);
    numbers_ += of_each * std::ssize(candidates);
    std::vector<Running> running;
    const auto set_next_look = [&](Evaluation* evaluation, size_t look) {
      evaluation->records.resize(std::min(look, order.size()));
      evaluation->costs.resize(evaluation->records.size());
    };
    for (const Gains& gains : candidates)
      set_next_look(&running.emplace_back(Running{.evaluation = {.gains = gains}}).evaluation,
                    first);
    const auto running_of = [&](const auto& trial) -> Running& {
      return running[static_cast<size_t>(trial.cell - first_evaluation)];
    };
    // The next trial of the first candidate that has one to ask for.
    const auto next = [&]() -> std::optional<int64_t> {
      for (size_t i = 0; i < running.size(); ++i)
        if (Running& r = running[i]; r.asked < r.evaluation.records.size() && !r.ended)
          return first_number + static_cast<int64_t>(i) * of_each + static_cast<int64_t>(r.asked++);
      return std::nullopt;
    };
    // A look decides by the trials before it only, whatever else is known: the same whenever it is
    // taken.
    const auto add = [&](const batch::StoredTrial& trial) {
      if (!std::isfinite(trial.record.time_s))
        throw ConfigError(file_ + fmt::format(": is damaged (trial {} has no time)", trial.trial));
      Running& r = running_of(trial);
      Evaluation& evaluation = r.evaluation;
      evaluation.records[static_cast<size_t>(trial.sample)] = trial.record;
      evaluation.costs[static_cast<size_t>(trial.sample)] = Sum(study_.CostsOf(trial.record));
      ++trials_;
      if (++r.done < evaluation.records.size()) return;
      r.ended = r.done == order.size() || !go_on(evaluation);
      evaluation.given_up = r.ended && r.done < order.size();
      if (!r.ended) set_next_look(&evaluation, r.done + static_cast<size_t>(racing.every));
    };
    const auto spec = [&](int64_t trial) {
      batch::TrialSpec of;
      of.trial = trial;
      of.cell = first_evaluation + (trial - first_number) / of_each;
      of.sample = (trial - first_number) % of_each;
      const batch::TrialSpec planned = plan.Trial(order[static_cast<size_t>(of.sample)]);
      of.seed = planned.seed;
      of.parameters = planned.parameters;
      of.parameters.insert(of.parameters.begin(), {kPhaseKey, phase});
      const Gains& gains = running_of(of).evaluation.gains;
      for (size_t i = 0; i < gains.size(); ++i)
        of.parameters.push_back({study_.settings().gains[i].key, FormatNumber(gains[i])});
      return of;
    };
    const auto scenario = [&](const batch::TrialSpec& of) {
      return study_.ScenarioOf(plan, order[static_cast<size_t>(of.sample)],
                               running_of(of).evaluation.gains, cameras);
    };
    const bool ended = runner_.Run({.spec = spec,
                                    .scenario = scenario,
                                    .series_every_frames = plan.settings().series_every_frames},
                                   {.next = next, .add = add});
    if (!ended) throw batch::Stopped();
    std::vector<Evaluation> evaluations;
    evaluations.reserve(running.size());
    for (Running& r : running) evaluations.push_back(std::move(r.evaluation));
    return evaluations;
  }

  int64_t trials() const { return trials_; }  // evaluated so far, run or found
  int64_t trials_run() const { return runner_.progress().done_now; }

 private:
  const Study& study_;
  std::string file_;
  batch::ResultStore store_;
  int64_t evaluations_ = 0, numbers_ = 0;  // asked for so far, and trials that have a number
  int64_t trials_ = 0;
  batch::TrialRunner runner_;
};

// ------------------------------------------------------------------------------------------ search

// Everything that happens between the optimiser's question and its answer.
class Tuning {
 public:
  Tuning(const Study& study, const std::string& file, const TuningOptions& options)
      : study_(study),
        settings_(study.settings()),
        options_(options),
        evaluations_(study, file, options.anew,
                     {.jobs = options.jobs,
                      .time_limit_s = study.plan().settings().trial_time_limit_s,
                      .plugins = study.plan().plugins(),
                      .on_progress = [this](const batch::RunProgress&) { ShowProgress(); },
                      .stop_requested = options.stop_requested}) {}

  TuningResult Run() {
    result_.start = result_.tuned = study_.start();
    Tell();
    search::Optimise(settings_.optimiser,
                     static_cast<uint64_t>(study_.plan().settings().master_seed),
                     study_.CandidateOf(study_.start()),
                     [this](int generation, const std::vector<search::Candidate>& candidates) {
                       return Generation(generation, candidates);
                     });
    // The tuned gains against those that were there before, on the same trials.
    const batch::Plan proof = study_.TrialsOf(kHeldOutSet, settings_.proof.held_out_seeds);
    Begin("held out", 2 * proof.trials(), 0, 1);
    const std::vector<Evaluation> both =
        evaluations_.Run(phase_, proof, {study_.start(), result_.tuned}, settings_.proof.cameras);
    result_.held_out = Compare(study_, both[0], both[1]);
    result_.finished = true;
    Tell();
    return result_;
  }

 private:
  // Costs of the candidates. All of them run the same trials as the incumbent, of seeds of their
  // own in every generation.
  std::vector<double> Generation(int generation, const std::vector<search::Candidate>& candidates) {
    const batch::Plan plan = TrialsOf(generation == 0 ? 0 : generation + 1);
    const double step = 1.0 / (settings_.optimiser.generations + 1);
    Begin(fmt::format("generation {}", generation),
          plan.trials() * (generation == 0 ? 1 : 1 + std::ssize(candidates)), generation * step,
          step);
    incumbent_ = evaluations_.Run(phase_ + " incumbent", plan, {result_.tuned})[0];
    std::vector<Evaluation> done = {incumbent_};
    if (generation == 0) {
      RequireAStart();  // which is the incumbent
    } else {
      std::vector<Gains> gains;
      gains.reserve(candidates.size());
      for (const search::Candidate& c : candidates) gains.push_back(study_.GainsAt(c));
      done = evaluations_.Run(phase_, plan, gains, /*cameras=*/false,
                              [this](const Evaluation& e) { return MayWin(e); });
    }
    std::vector<double> costs;
    costs.reserve(done.size());
    for (const Evaluation& evaluation : done) costs.push_back(CostOf(evaluation));
    Record(generation, done, costs);
    return costs;
  }

  // What follows is a part of the bar, of so many trials at most but for a challenge.
  void Begin(const std::string& phase, int64_t trials, double from, double part) {
    phase_ = phase;
    bar_ = {.from = from, .part = part, .trials = trials, .before = evaluations_.trials()};
  }

  void ShowProgress() const {
    if (!options_.on_progress) return;
    const int64_t done = evaluations_.trials() - bar_.before, most = std::max(done, bar_.trials);
    options_.on_progress(fmt::format("{}: {} of at most {} trials", phase_, done, most),
                         bar_.from + bar_.part * static_cast<double>(done) /
                                         static_cast<double>(std::max<int64_t>(most, 1)));
  }

  batch::Plan TrialsOf(uint64_t set) const {
    return study_.TrialsOf(set, study_.plan().settings().seeds);
  }

  void RequireAStart() const {
    if (settings_.start_may_fail || incumbent_.success_rate() > 0) return;
    const trial::TrialRecord& first = incumbent_.records[0];
    throw ConfigError(fmt::format(
        "the starting gains fail in every one of {} trials; for instance seed {}: {}. Give better "
        "ones, or set start_may_fail: true in the study",
        incumbent_.records.size(), first.seed, first.reason));
  }

  // What is missing in successes costs.
  double Penalty(const Evaluation& evaluation) const {
    return settings_.success_weight *
           std::max(0.0, settings_.success_at_least - evaluation.success_rate());
  }

  // The incumbent's costs on the trials that a candidate has run.
  std::vector<double> SameCosts(const Evaluation& evaluation) const {
    return {incumbent_.costs.begin(), incumbent_.costs.begin() + std::ssize(evaluation.costs)};
  }

  // Of a candidate given up: the incumbent's cost on all trials and the difference so far.
  double CostOf(const Evaluation& evaluation) const {
    return Mean(incumbent_.costs) + Mean(evaluation.costs) - Mean(SameCosts(evaluation)) +
           Penalty(evaluation);
  }

  // Racing's rule (RacingParams).
  bool MayWin(const Evaluation& so_far) const {
    const RacingParams& racing = settings_.racing;
    const auto total = static_cast<double>(incumbent_.costs.size());
    const double looks = std::max(1.0, std::ceil((total - racing.first) / racing.every));
    const auto worse = statistics::ComparePairs(SameCosts(so_far), so_far.costs, so_far.seeds());
    return worse.mean <= 0 || worse.t_p / 2 >= (1 - racing.confidence) / looks;
  }

  // Whether the best candidate takes the incumbent's place: when it is better on these trials and
  // on as many new ones together. One set of seeds alone would prefer who is lucky on it.
  bool Replaces(int generation, const Evaluation& best) {
    const std::vector<Evaluation> both =
        evaluations_.Run(fmt::format("challenge {}", generation),
                         TrialsOf(kFirstChallengeSet + static_cast<uint64_t>(generation)),
                         {incumbent_.gains, best.gains});
    const auto cost = [this](const Evaluation& e) { return Mean(e.costs) + Penalty(e); };
    return cost(Joined(best, both[1])) < cost(Joined(incumbent_, both[0]));
  }

  void Record(int generation, const std::vector<Evaluation>& done,
              const std::vector<double>& costs) {
    const auto best = static_cast<size_t>(std::ranges::min_element(costs) - costs.begin());
    GenerationRecord record{
        .generation = generation,
        .candidates = static_cast<int>(std::ssize(done)),
        .given_up = static_cast<int>(std::ranges::count_if(done, &Evaluation::given_up)),
        .best = costs[best],
        .median = statistics::Median(costs).value_or(0),
        .incumbent = CostOf(incumbent_),
        .incumbent_success = incumbent_.success_rate()};
    record.replaced = !done[best].given_up && costs[best] < record.incumbent &&
                      done[best].gains != incumbent_.gains && Replaces(generation, done[best]);
    if (record.replaced) result_.tuned = done[best].gains;
    for (size_t i = 0; i < done.size(); ++i) record.tried.push_back({done[i].gains, costs[i]});
    record.trials = evaluations_.trials();
    record.gains = result_.tuned;
    result_.generations.push_back(record);
    Tell();
  }

  void Tell() {
    result_.trials = evaluations_.trials();
    result_.trials_run = evaluations_.trials_run();
    if (options_.on_result) options_.on_result(result_);
  }

  const Study& study_;
  const TuningSettings& settings_;
  const TuningOptions& options_;
  std::string phase_;
  struct {
    double from = 0, part = 0;
    int64_t trials = 0, before = 0;
  } bar_;
  Evaluations evaluations_;
  TuningResult result_;
  Evaluation incumbent_;
};

}  // namespace

TuningResult Tune(const Study& study, const std::string& file, const TuningOptions& options) {
  return Tuning(study, file, options).Run();
}

}  // namespace turbidock::tuning
