#pragma once
// Runs the trials of candidates in worker processes and keeps every one of them.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "experiments/farm/result_store.h"
#include "experiments/farm/runner.h"
#include "experiments/studies/tuning/study.h"

namespace turbidock::tuning {

using farm::Stopped;

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
    std::function<void(int64_t trials)> on_trial = nullptr;
    std::function<bool()> stop_requested = nullptr;
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

  int64_t trials() const { return trials_; }  // evaluated so far, run or found
  // Of this process.
  const farm::RunProgress& progress() const { return runner_.progress(); }

 private:
  std::vector<farm::Parameter> ParametersOf(const std::string& phase, const Gains& gains) const;

  const Study& study_;
  std::string file_;
  farm::ResultStore store_;
  int64_t evaluations_ = 0, trials_ = 0;
  farm::TrialRunner runner_;
};

}  // namespace turbidock::tuning
