#pragma once
// SQLite for the file of results: its errors as ours, and cells as its values.

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <string>
#include <vector>

#include "experiments/trial/cell.h"
#include "sim/base/check.h"

namespace turbidock::farm {

// What an error says about a file: "is locked by another program".
const char* ProblemOf(const SQLite::Exception& error);

// Does `act`; an error of SQLite's becomes a ConfigError that names the file.
template <class Do>
auto Guard(const std::string& file, const Do& act) {
  try {
    return act();
  } catch (const SQLite::Exception& error) {
    throw ConfigError(fmt::format("{}: {} ({})", file, ProblemOf(error), error.what()));
  }
}

// For a file that may come from anywhere: what its schema says is not done, and nothing in it is
// believed to be of a sensible size.
void Harden(const SQLite::Database& db);

trial::Cell CellIn(const SQLite::Column& column);

// Adds rows of a trial to a table.
class TrialInsert {
 public:
  // `columns` beside the trial's number.
  TrialInsert(const SQLite::Database& db, const std::string& table,
              const std::vector<std::string>& columns);
  void Run(int64_t trial, const std::vector<trial::Cell>& cells);

 private:
  SQLite::Statement statement_;
};

}  // namespace turbidock::farm
