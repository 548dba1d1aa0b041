#include "experiments/farm/store_schema.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "experiments/trial/record_columns.h"
#include "experiments/trial/trial_files.h"
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

// Of a trajectory.csv.
std::vector<std::string> SeriesColumns() {
  std::istringstream csv(trial::TrajectoryCsv({}));
  std::string header;
  std::getline(csv, header);
  std::istringstream line(header);
  std::vector<std::string> columns;
  for (std::string name; std::getline(line, name, ',');) columns.push_back(name);
  return columns;
}

// What a table must have, and what its other columns are if it has them: name and declared type.
struct TableSchema {
  std::string name;
  std::map<std::string, std::string> required, known{};
};

std::vector<TableSchema> Schema() {
  std::vector<TableSchema> schema = {{"meta", {{"key", "TEXT"}, {"value", "TEXT"}}},
                                     {"parameters", {{"trial", "INTEGER"}}},
                                     {"series", {{"trial", "INTEGER"}, {"frame", ""}}}};
  for (const RecordTable& table : RecordTables()) {
    TableSchema& one = schema.emplace_back(TableSchema{table.name, {{"trial", "INTEGER"}}});
    for (const size_t i : table.columns) {
      const std::string type = trial::Columns()[i].sql_type;
      one.known[trial::Columns()[i].name] = type.substr(0, type.find(' '));
    }
    if (one.name != kTrialsTable) continue;
    for (const char* number : {"cell", "sample"}) one.required[number] = "INTEGER";
    for (const char* word : {"seed", "outcome", "failure", "digest"})
      one.required[word] = one.known.at(word);
  }
  return schema;
}

}  // namespace

const std::vector<RecordTable>& RecordTables() {
  static const std::vector<RecordTable> kTablesOfRecord = {
      {kTrialsTable, ColumnsOf({Place::kKey, Place::kVerdict, Place::kRemark})},
      {"metrics", ColumnsOf({Place::kFigure})},
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
  db->exec("CREATE TABLE series (trial INTEGER NOT NULL" + QuotedList(SeriesColumns()) +
           ", PRIMARY KEY (trial, frame)) WITHOUT ROWID");
  db->exec(
      "CREATE VIEW results AS SELECT * FROM trials JOIN parameters USING (trial) "
      "JOIN metrics USING (trial)");
}

void RequireSchema(const SQLite::Database& db, const std::string& file) {
  const auto fail = [&file](const std::string& problem) {
    throw ConfigError(file + ": is no result file of this program: " + problem);
  };
  const std::vector<TableSchema> schema = Schema();
  std::map<std::string, std::string> kinds;
  SQLite::Statement master(db, "SELECT type, name FROM sqlite_master");
  while (master.executeStep()) {
    const std::string kind = master.getColumn(0).getString();
    const std::string name = master.getColumn(1).getString();
    kinds.emplace(name, kind);
    const bool is_known = std::ranges::find(schema, name, &TableSchema::name) != schema.end();
    if (kind == "trigger" || (kind == "table" && !is_known && !name.starts_with("sqlite_")))
      fail(fmt::format("it has a {} {}", kind, name));
  }
  for (const TableSchema& table : schema) {
    const auto found = kinds.find(table.name);
    if (found == kinds.end() || found->second != "table") fail("it has no table " + table.name);
    std::map<std::string, std::string> columns;
    SQLite::Statement query(db, "SELECT name, type FROM pragma_table_info(?)");
    query.bind(1, table.name);
    while (query.executeStep())
      columns[query.getColumn(0).getString()] = query.getColumn(1).getString();
    for (const auto& [name, type] : table.required)
      if (!columns.contains(name)) fail(fmt::format("table {} has no column {}", table.name, name));
    for (const auto* part : {&table.required, &table.known})
      for (const auto& [name, type] : *part)
        if (const auto column = columns.find(name);
            column != columns.end() && column->second != type)
          fail(fmt::format("column {} of table {} is {}, must be {}", name, table.name,
                           column->second.empty() ? "of no type" : column->second, type));
  }
}

}  // namespace turbidock::farm
