#pragma once
// SQLite for the file of results: its tables (README.md), its errors as ours, cells as its
// values; and the lock of who writes it.

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <string>
#include <vector>

#include "experiments/trial/record_columns.h"
#include "sim/base/check.h"

namespace turbidock::batch {

// Holds a lock on a file, which it makes if there is none. It ends with the process however that
// ends, and is not inherited by workers.
class RunLock {
 public:
  // ConfigError when another process holds it or the file cannot be made.
  explicit RunLock(const std::string& file);
  ~RunLock();
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  int fd_ = -1;
};

// A name as SQL: keys such as water.milk_ml_m3 are column names. And several, with commas between.
std::string Quoted(const std::string& name);
std::string QuotedList(const std::vector<std::string>& names);

// The columns of `trials` that are parameters.
std::vector<std::string> KeysIn(const SQLite::Database& db);

// Makes all tables in an empty database; `keys` are the parameters'.
void CreateTables(const std::vector<std::string>& keys, SQLite::Database* db);

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

// Adds a row with these values in these columns.
void InsertRow(const SQLite::Database& db, const std::string& table,
               const std::vector<std::string>& columns, const std::vector<trial::Cell>& cells);

}  // namespace turbidock::batch
