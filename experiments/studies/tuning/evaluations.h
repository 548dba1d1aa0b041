#pragma once
// Runs the trials of candidates in worker processes and keeps every one of them.

#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "experiments/farm/result_store.h"
#include "experiments/farm/trial_pool.h"
#include "experiments/studies/tuning/study.h"

namespace turbidock::tuning {

// Thrown out of an evaluation when the caller asked to stop. What was stored stays.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped") {}
};

// One candidate's trials on one set of seeds.
struct Evaluation {
  int64_t number = 0;  // in the order in which they were asked for
  Gains gains;
  // In fair order; fewer than asked for where it was given up.
  std::vector<trial::TrialRecord> records{};
  bool given_up = false;

  double success_rate() const;
};

// Numbers that follow from the study alone, so that a run that is started again finds its trials:
// what is asked for must depend on nothing else.
class Evaluations {
 public:
  struct Options {
    farm::FarmOptions farm = {};
    double trial_time_limit_s = 3600;
    // After every one that was run, and every second, with the trials evaluated so far.
    std::function<void(int64_t trials)> on_trial;
    std::function<bool()> stop_requested;
  };

  Evaluations(const Study& study, const std::string& file, const Options& options);

  // Decides after some of the trials whether to go on; asked at racing's looks only.
  using GoOn = std::function<bool(const Evaluation& so_far)>;
  // What to evaluate, and what scenario to make of its trials.
  struct Request {
    Gains gains;
    std::function<void(trial::Scenario*)> change = nullptr;  // besides the gains
  };

  // Evaluates side by side. `phase` names what for in the file. Stopped when asked to.
  std::vector<Evaluation> Run(const std::string& phase, const farm::Plan& plan,
                              const std::vector<Request>& requests, const GoOn& go_on = nullptr);

  int64_t trials() const { return trials_; }          // evaluated so far, run or found
  int64_t trials_run() const { return trials_run_; }  // of them in this run
  double worker_time_s() const { return worker_time_s_; }

 private:
  std::vector<farm::Parameter> ParametersOf(const std::string& phase, const Gains& gains) const;

  const Study& study_;
  Options options_;
  farm::ResultStore store_;
  std::map<int64_t, farm::StoredTrial> known_;
  farm::TrialPool pool_;
  int64_t evaluations_ = 0, trials_ = 0, trials_run_ = 0;
  double worker_time_s_ = 0;
};

}  // namespace turbidock::tuning
