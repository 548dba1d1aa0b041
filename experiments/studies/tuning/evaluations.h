#pragma once
// Runs the trials of candidates in worker processes and keeps every one of them.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "experiments/batch/result_store.h"
#include "experiments/batch/runner.h"
#include "experiments/studies/tuning/study.h"

namespace turbidock::tuning {

using batch::Stopped;

// One candidate's trials on one set of seeds.
struct Evaluation {
  int64_t number = 0;  // in the order in which they were asked for
  Gains gains;
  // Cell by cell in turn; fewer than asked for where it was given up.
  std::vector<trial::TrialRecord> records{};
  bool given_up = false;

  double success_rate() const;
};

// Numbers that follow from the study alone, so that a run that is started again finds its trials:
// what is asked for must depend on nothing else.
class Evaluations {
 public:
  Evaluations(const Study& study, const std::string& file, const batch::RunOptions& options);

  // Decides after some of the trials whether to go on; asked at racing's looks only.
  using GoOn = std::function<bool(const Evaluation& so_far)>;

  // Evaluates gains side by side, through the cameras whatever the study says if `cameras`. `phase`
  // names what for in the file. Stopped when asked to.
  std::vector<Evaluation> Run(const std::string& phase, const batch::Plan& plan,
                              const std::vector<Gains>& candidates, bool cameras = false,
                              const GoOn& go_on = nullptr);

  int64_t trials() const { return trials_; }  // evaluated so far, run or found
  // Of this process.
  const batch::RunProgress& progress() const { return runner_.progress(); }

 private:
  const Study& study_;
  std::string file_;
  batch::ResultStore store_;
  int64_t evaluations_ = 0, numbers_ = 0;  // asked for so far, and trials that have a number
  int64_t trials_ = 0;
  batch::TrialRunner runner_;
};

}  // namespace turbidock::tuning
