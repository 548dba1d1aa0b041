#pragma once
// The results of many trials in one SQLite file. The tables are documented in README.md of this
// folder: pandas and the sqlite3 shell read them directly.
//
// A trial is one transaction that is on the disk when Add returns: a process killed at any moment,
// or the power, costs the trials under way and nothing else.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/batch/store_header.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_record.h"
#include "sim/base/check.h"

namespace SQLite {
class Database;
}  // namespace SQLite

namespace turbidock::batch {

class RunLock;

inline constexpr int kStoreSchema = 8;

struct TrialRule {
  int64_t cells = 1;
  int64_t batch = 1;                // trials of a cell after which it is looked at
  int64_t most = 1;                 // trials of a cell
  std::optional<double> precision;  // half width of a cell's interval; none: every trial is to run
  int64_t strata = 1;               // a cell's samples are of each in turn
  // Of a plan with ranges: cells are lattices of this one, and what it chooses is run.
  std::optional<search::BoundarySearch> search = {};

  // What is decided about alone: a cell, or all cells of a lattice.
  int64_t unit_of(int64_t cell) const { return search ? cell / search->lattice.cells() : cell; }
};

// Whether the shard runs this trial: without a precision a shard takes whole rounds of strata, with
// one whole cells, with ranges whole lattices, which it decides about alone.
bool IsOf(const Shard& shard, const TrialRule& rule, int64_t trial);

// The rule that a file's trials follow. Without a precision it knows of no cells.
TrialRule RuleOf(const StoreHeader& header);

// Results that should be equal or belong together and do not. Exit code 5.
class MismatchError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A file whose trials are not those that this program would run.
class OtherResults : public ConfigError {
 public:
  // `way_out`: what else one may do.
  OtherResults(
      const std::string& file, const std::string& how,
      const std::string& way_out = ", finish it as it was begun, or run what changed with --anew")
      : ConfigError(file + ": was begun with something else: " + how + ". Write elsewhere" +
                    way_out) {}
};

struct StoredTrial {
  int64_t trial = 0, cell = 0, sample = 0;
  std::vector<Parameter> parameters;  // values of StoreHeader::keys
  std::string identity = {};          // trial/identity.h
  trial::TrialRecord record = {};
  trial::Series series = {};  // to be stored; reading does not fill it
};

// A parameter's value as a file has it: a number, or text where its key is one of texts.
trial::Cell ValueOf(const Parameter& parameter);

class ResultStore {
 public:
  // Makes the file, or opens one whose header is the same, and keeps other writers out.
  // OtherResults when it is another plan's, build's or shard's; ConfigError that says why when it
  // is in use, damaged, of another schema, no such file at all, or cannot be written.
  static ResultStore Write(const std::string& file, const StoreHeader& header);
  // The same, whatever an existing file holds: header() says what that is. Only its kind and shard
  // must be these.
  static ResultStore Open(const std::string& file, const StoreHeader& header);
  // Opens a file that exists, also while another process writes to it.
  static ResultStore Read(const std::string& file);
  ResultStore(ResultStore&&) noexcept;
  ~ResultStore();

  const StoreHeader& header() const { return header_; }
  const std::string& file() const { return file_; }
  // The plan; where the file has moved since it was begun, with its files as near to it as they
  // were.
  std::string PlanHere() const;

  // Has the file hold the results of another plan, all at once: `numbers` says which of its trials
  // stay, and which number and cell each has from now on; the others go.
  struct Renumbered {
    int64_t before = 0, trial = 0, cell = 0;
  };
  void Become(const StoreHeader& header, const std::vector<Renumbered>& numbers);

  // Stores a trial; ConfigError when it cannot be (a full disk): the file is then as it was.
  void Add(const StoredTrial& trial);

  // Takes over every trial of another file of the same plan and build. MismatchError when a trial
  // is in both and differs; the file is then as it was.
  void Merge(const std::string& other_file);

  std::vector<int64_t> Done() const;          // the numbers of the stored trials, ascending
  std::map<int64_t, bool> Successes() const;  // of those that say so, whether each succeeded
  std::vector<StoredTrial> Trials() const;    // ascending
  std::optional<StoredTrial> Find(int64_t trial) const;
  StoredTrial Trial(int64_t trial) const;  // ConfigError when it is not there
  // The view `results`, or the table `trials`, which also has what differs from run to run; empty
  // without trials.
  std::string Csv(bool timing = false) const;

  // What came of a job that is no trial, by its number; kept as a trial is. MismatchError when it
  // was another input's.
  void AddOutput(int64_t job, const std::string& input, const std::string& output);
  std::optional<std::string> OutputOf(int64_t job, const std::string& input) const;

  // Each renderer, with one of the trials that it drew.
  void ForEachRenderer(
      const std::function<void(const std::string& renderer, int64_t trial)>& act) const;

  std::vector<int64_t> TrialsWithSeries() const;  // whose series was stored, ascending
  trial::Series SeriesOf(int64_t trial) const;    // the rows that were stored, if any

 private:
  ResultStore(std::string file, bool writes);

  void Create(const StoreHeader& header);
  void WriteMeta(const StoreHeader& header);
  void ReadHeader();  // with all that is asked of a file before anything in it is used
  void RequireRows() const;
  [[noreturn]] void FailDamaged(const std::string& how) const;
  void Insert(const StoredTrial& trial);
  void InsertSeries(const StoredTrial& trial);
  template <class Act>
  void ForEachRow(const std::string& query, const Act& act) const;
  std::vector<std::string> TrialColumns() const;
  std::vector<int64_t> Numbers(const std::string& query) const;
  std::vector<StoredTrial> Select(const std::string& where) const;

  std::string file_;
  std::unique_ptr<RunLock> lock_;
  std::unique_ptr<SQLite::Database> db_;
  StoreHeader header_;
  std::string begun_in_;  // a folder
};

// Whether a process writes to the file now.
bool IsLocked(const std::string& file);

}  // namespace turbidock::batch
