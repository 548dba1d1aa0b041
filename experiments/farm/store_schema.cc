#include "experiments/farm/store_schema.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <map>
#include <set>

#include "experiments/trial/record_columns.h"
#include "experiments/trial/series.h"
#include "sim/base/check.h"

namespace turbidock::farm {
namespace {

using trial::Place;

// Indices of the record's columns of these places, place by place.
std::vector<size_t> ColumnsOf(const std::vector<Place>& places) {
  std::vector<size_t> columns;
  for (const Place place : places)
    for (size_t i = 0; i < trial::Columns().size(); ++i)
      if (trial::Columns()[i].place == place) columns.push_back(i);
  return columns;
}

// Columns of a table and their declared types.
std::map<std::string, std::string> TypesIn(const SQLite::Database& db, const std::string& table) {
  std::map<std::string, std::string> types;
  SQLite::Statement query(db, "SELECT name, type FROM pragma_table_info(?)");
  query.bind(1, table);
  while (query.executeStep())
    types[query.getColumn(0).getString()] = query.getColumn(1).getString();
  return types;
}

}  // namespace

const std::vector<RecordTable>& RecordTables() {
  static const std::vector<RecordTable> kTablesOfRecord = {
      {kTrialsTable, ColumnsOf({Place::kKey, Place::kVerdict, Place::kRemark})},
      {"metrics", ColumnsOf({Place::kMetric})},
      {"runs", ColumnsOf({Place::kRun, Place::kLog})}};
  return kTablesOfRecord;
}

std::string Quoted(const std::string& name) {
  std::string quoted = "\"";
  for (const char c : name) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string QuotedList(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += ", " + Quoted(name);
  return list;
}

std::vector<std::string> OwnColumns(const SQLite::Database& db, const std::string& table) {
  std::vector<std::string> columns;
  SQLite::Statement query(db, "SELECT name FROM pragma_table_info(?) WHERE name <> 'trial'");
  query.bind(1, table);
  while (query.executeStep()) columns.push_back(query.getColumn(0).getString());
  return columns;
}

void CreateTables(const std::vector<std::string>& keys, SQLite::Database* db) {
  db->exec("CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID");
  for (const RecordTable& table : RecordTables()) {
    std::string columns = "trial INTEGER PRIMARY KEY";
    if (table.name == kTrialsTable) columns += ", cell INTEGER NOT NULL, sample INTEGER NOT NULL";
    for (const size_t i : table.columns)
      columns += ", " + Quoted(trial::Columns()[i].name) + " " + trial::Columns()[i].sql_type;
    db->exec(fmt::format("CREATE TABLE {} ({})", table.name, columns));
  }
  db->exec("CREATE TABLE parameters (trial INTEGER PRIMARY KEY" + QuotedList(keys) + ")");
  std::string series;
  const trial::Series empty(trial::TrialLog().thrusters);
  for (const trial::Series::Column& column : empty.columns())
    series += fmt::format(", {} {}", Quoted(column.name),
                          // of no type, not REAL, which loses the sign of zero
                          std::array{"INTEGER", "", "TEXT"}[column.values.index()]);
  db->exec("CREATE TABLE series (trial INTEGER NOT NULL" + series +
           ", PRIMARY KEY (trial, frame)) WITHOUT ROWID");
  db->exec(
      "CREATE VIEW results AS SELECT * FROM trials JOIN parameters USING (trial) "
      "JOIN metrics USING (trial)");
}

void RequireSchema(const SQLite::Database& db, const std::string& file) {
  const auto fail = [&file](const std::string& problem) {
    throw ConfigError(file + ": is no result file of this program: " + problem);
  };
  SQLite::Database model(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  CreateTables(OwnColumns(db, "parameters"), &model);
  const std::string tables = "SELECT name FROM sqlite_master WHERE type = 'table'";
  std::set<std::string> known;
  SQLite::Statement made(model, tables);
  while (made.executeStep()) known.insert(made.getColumn(0).getString());
  std::set<std::string> there;
  SQLite::Statement master(db,
                           "SELECT name, type FROM sqlite_master WHERE type IN "
                           "('table', 'trigger')");
  while (master.executeStep()) {
    const std::string name = master.getColumn(0).getString();
    const std::string type = master.getColumn(1).getString();
    there.insert(name);
    if (type == "trigger" || (!known.contains(name) && !name.starts_with("sqlite_")))
      fail(fmt::format("it has a {} {}", type, name));
  }
  for (const std::string& table : known) {
    if (!there.contains(table)) fail("it has no table " + table);
    const auto wanted = TypesIn(model, table), columns = TypesIn(db, table);
    for (const auto& [name, type] : wanted) {
      const auto column = columns.find(name);
      if (column == columns.end())
        fail(fmt::format("table {} has no column {}", table, name));
      else if (column->second != type)
        fail(fmt::format("column {} of table {} is {}, must be {}", name, table,
                         column->second.empty() ? "of no type" : column->second,
                         type.empty() ? "of no type" : type));
    }
    for (const auto& [name, type] : columns)
      if (!wanted.contains(name) && !(table == "series" && name.ends_with("_v") && type.empty()))
        fail(fmt::format("it knows no column {} of table {}", name, table));
  }
}

}  // namespace turbidock::farm
