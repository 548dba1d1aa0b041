#pragma once
// The tables of a file of results (README.md): which part of a trial stands in which, making them,
// and whether a file that may come from anywhere has them.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace SQLite {
class Database;
}  // namespace SQLite

namespace turbidock::farm {

// The tables that have one row a trial, and `series`, which has many; that of the trials last.
inline constexpr std::array kTables = {"parameters", "metrics", "runs", "series", "trials"};
inline constexpr const char* kTrialsTable = "trials";

// The tables that have a part of every trial's record, and the indices of its columns in
// trial::Columns(), in the table's order.
struct RecordTable {
  std::string name;
  std::vector<size_t> columns;
};
const std::vector<RecordTable>& RecordTables();

// A name as SQL: keys such as water.milk_ml_m3 are column names. And several, each after a comma.
std::string Quoted(const std::string& name);
std::string QuotedList(const std::vector<std::string>& names);

// The columns of a table but the trial's number.
std::vector<std::string> OwnColumns(const SQLite::Database& db, const std::string& table);

// Makes all tables in an empty database; `keys` are the parameters'.
void CreateTables(const std::vector<std::string>& keys, SQLite::Database* db);

// ConfigError naming the first table or column that is not as CreateTables makes them, or a
// trigger. The series may have a column for each of more thrusters.
void RequireSchema(const SQLite::Database& db, const std::string& file);

}  // namespace turbidock::farm
