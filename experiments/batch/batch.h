#pragma once
// Which trials of a batch are to run, as far as its results show; and runs them.
//
// Without a precision: all. With one, a cell runs `seeds` trials, then as many again, and so on,
// until the 95 % interval of its success rate (Wilson's, over the plan's strata if it has any) is
// narrow enough.
// That is decided after those numbers of trials only, and on the cell's first so many trials
// whichever ended first: a batch consists of the same trials for any number of workers and shards,
// also when it is interrupted.
//
// With ranges: those that a search for the boundary chooses (search/boundary_search.h), round by
// round, for each combination of cases and grid by itself. A round is chosen once all trials of
// those before it have ended, from them alone.
//
// Looking more than once costs little: at a precision of 0.03, looked at every 30 trials, 93.8 % of
// the intervals at least hold the true rate where that is 0.02 to 0.98 (94.0 % at fixed numbers of
// trials), and the rate found is on average up to 0.004 too near to 0 or 1. Over six strata, across
// which success falls steeply, gently or not at all, it is 94.1 to 99.8 %.

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/batch/result_store.h"
#include "experiments/batch/runner.h"
#include "experiments/statistics/intervals.h"

namespace turbidock::batch {

class TrialScheduler {
 public:
  TrialScheduler(const TrialRule& rule, const Shard& shard);

  // Notes what came of a trial: each once, in any order. Nothing: it was run and says nothing of
  // success (no_answer).
  void Add(int64_t trial, std::optional<bool> success);
  // A trial to run; each is returned once. Nothing when there is none or when results must come
  // first.
  std::optional<int64_t> Next();

  // All of the shard.
  bool complete() const { return done_ == wanted_; }
  int64_t done() const { return done_; }
  int64_t successes() const { return successes_; }  // of those that are done
  int64_t wanted() const { return wanted_; }        // as far as is known: the least there will be
  int64_t most() const;
  // Cells, or with ranges lattices, of the shard; cells that are known well enough.
  int64_t cells() const { return cells_of_shard_; }
  int64_t reached() const { return reached_; }

 private:
  enum class Result : uint8_t { kUnknown, kFailure, kSuccess, kNeither };
  struct Cell {
    std::vector<Result> results;            // by sample
    int64_t next = 0;                       // the samples before have been handed out
    int64_t wanted = 0;                     // so many samples are to run
    int64_t counted = 0;                    // the first samples, up to one without a result
    std::vector<statistics::Count> strata;  // of those that are counted
    bool decided = false;

    Result Of(int64_t sample) const {
      return sample < std::ssize(results) ? results[static_cast<size_t>(sample)] : Result::kUnknown;
    }
  };

  // A lattice's trials.
  struct Lattice {
    int64_t wanted = 0, known = 0;
    bool decided = false;
  };

  bool Owns(int64_t trial) const { return IsOf(shard_, rule_, trial); }
  void WantMore(int64_t cell, int64_t count);
  void Decide(int64_t cell);
  void ChooseRounds(int64_t lattice);  // as far as the results go
  std::vector<int> NextRoundOf(int64_t lattice) const;

  TrialRule rule_;
  Shard shard_;
  std::vector<Cell> cells_;
  std::vector<Lattice> lattices_;
  std::deque<int64_t> open_;  // cells that may have samples to hand out
  int64_t done_ = 0, successes_ = 0, wanted_ = 0;
  int64_t cells_of_shard_ = 0, reached_ = 0;
};

// The scheduler after the trials in a file.
TrialScheduler SchedulerOf(const ResultStore& store);

struct BatchProgress : RunProgress {
  int64_t done = 0, total = 0;  // of the shard; `done` has those of earlier runs
  int64_t most = 0;       // with a precision `total` is the least, and this what it can become
  int64_t successes = 0;  // of `done`
};

// A plan's file of results, made or opened. What is in it stays where it is of the plan and its
// identity is the same, also when the plan has more cells, cases or trials than when the file was
// begun. Trials that would be others now are named with what changed (OtherResults), or go with
// `anew`. OtherResults also for trials that the plan does not have, and for another kind or shard;
// a part of a batch stays of one plan.
// `jobs`: whose workers draw. `kind`: who writes it.
ResultStore OpenResults(const std::string& file, const Plan& plan, const Shard& shard, bool anew,
                        const JobOptions& jobs, const std::string& kind = "batch");

// Runs until all trials of the store's shard are in it, or it is stopped.
// Of `options`, time limit and plugins are the plan's; `on_progress` takes the place of its own.
// Errors as of TrialRunner::Run; what was stored stays.
BatchProgress RunBatch(const Plan& plan, RunOptions options,
                       const std::function<void(const BatchProgress&)>& on_progress,
                       ResultStore* store);

}  // namespace turbidock::batch
