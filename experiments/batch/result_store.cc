#include "experiments/batch/result_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "experiments/batch/store_sql.h"
#include "experiments/batch/trial_scheduler.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/table.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "experiments/trial/record_columns.h"

namespace turbidock::batch {
namespace {

namespace fs = std::filesystem;
using trial::Cell;

constexpr int kApplicationId = 0x54444f4b;  // "TDOK": tells our files from other SQLite databases
constexpr int kBusyTimeout_ms = 20000;      // a reader or a writer holds the file for milliseconds

// A parameter's.
std::string TextOf(const Cell& cell) {
  if (cell.is_string()) return cell.get<std::string>();
  return cell.is_null() ? "" : FormatNumber(cell.get<double>());
}

}  // namespace

Cell ValueOf(const Parameter& parameter) {
  static const std::set<std::string> texts = [] {
    std::set<std::string> keys = {"scenario", "case", kStratumKey};
    for (const config::KeyDoc& doc : trial::ScenarioKeys())
      if (doc.type == "text" || doc.type.starts_with("one of")) keys.insert(doc.key);
    return keys;
  }();
  const std::optional<double> number = report::NumberIn(parameter.value);
  return number && std::isfinite(*number) && !texts.contains(parameter.key) ? Cell(*number)
                                                                            : Cell(parameter.value);
}

template <class Act>
void ResultStore::ForEachRow(const std::string& query, const Act& act) const {
  Guard(file_, [&] {
    SQLite::Statement statement(*db_, query);
    while (statement.executeStep()) act(statement);
  });
}

ResultStore::ResultStore(ResultStore&&) noexcept = default;
ResultStore::~ResultStore() = default;

ResultStore::ResultStore(std::string file, bool writes) : file_(std::move(file)) {
  if (writes) {
    system::RequireWritable(file_, system::kResultFile);  // SQLite would open it for reading
    lock_ = std::make_unique<RunLock>(file_);
  }
  Guard(file_, [&] {
    int mode = SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE;
    // Reading, too, must be able to undo what a killed writer left half done; else nothing is
    // written.
    std::error_code ignored;
    const fs::path real = fs::weakly_canonical(file_, ignored);
    if (!writes)
      mode = fs::exists((ignored ? file_ : real.string()) + "-journal", ignored)
                 ? SQLite::OPEN_READWRITE
                 : SQLite::OPEN_READONLY;
    db_ = std::make_unique<SQLite::Database>(file_, mode, kBusyTimeout_ms);
    Harden(*db_);
    if (!writes) return;
    // A rollback journal, not a write-ahead log: the file alone is the whole result, and it works
    // on a cluster's network file system. EXTRA: on the disk before a transaction counts as done.
    db_->exec("PRAGMA journal_mode = DELETE; PRAGMA synchronous = EXTRA");
  });
}

ResultStore ResultStore::Write(const std::string& file, const StoreHeader& header) {
  ResultStore store(file, /*writes=*/true);
  Guard(file, [&] {
    const int tables = store.db_->execAndGet("SELECT count(*) FROM sqlite_master").getInt();
    if (tables == 0) store.Create(header);
    store.ReadHeader();
    if (!AsksForMore(header, store.header_)) return;
    SQLite::Transaction transaction(*store.db_, SQLite::TransactionBehavior::IMMEDIATE);
    store.WriteHeader(header);
    transaction.commit();
    store.ReadHeader();
  });
  std::vector<std::string> differences = Differences(store.header_, header);
  if (store.header_.shard != header.shard)
    differences.push_back("the file has shard " + store.header_.shard.Text() + ", this is shard " +
                          header.shard.Text());
  if (!differences.empty()) throw OtherResults(file, differences[0]);
  return store;
}

ResultStore ResultStore::Read(const std::string& file) {
  if (const std::string why = system::WhyUnreadable(file); !why.empty())
    throw ConfigError(file + ": " + why);
  ResultStore store(file, /*writes=*/false);
  Guard(file, [&] { store.ReadHeader(); });
  return store;
}

void ResultStore::Create(const StoreHeader& header) {
  SQLite::Transaction transaction(*db_, SQLite::TransactionBehavior::EXCLUSIVE);
  db_->exec(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}", kApplicationId,
                        kStoreSchema));
  CreateTables(header.keys, db_.get());
  WriteHeader(header);
  transaction.commit();
}

void ResultStore::WriteHeader(const StoreHeader& header) {
  SQLite::Statement replace(*db_, "REPLACE INTO meta (key, value) VALUES (?, ?)");
  for (const auto& [key, value] :
       std::map<std::string, std::string>{{"schema_version", std::to_string(kStoreSchema)},
                                          {"kind", header.kind},
                                          {"plan", header.plan},
                                          {"plan_hash", header.plan_hash()},
                                          {"build", header.build},
                                          {"shard", header.shard.Text()},
                                          {"trials", std::to_string(header.trials)}}) {
    replace.reset();
    replace.bind(1, key);
    replace.bind(2, value);
    replace.exec();
  }
}

void ResultStore::ReadHeader() {
  if (db_->execAndGet("SELECT count(*) FROM sqlite_master").getInt() == 0)
    throw ConfigError(file_ + ": is empty; no trial was stored");
  if (db_->execAndGet("PRAGMA application_id").getInt() != kApplicationId)
    throw ConfigError(file_ + ": is an SQLite database, but no result file of turbidock");
  const int schema = db_->execAndGet("PRAGMA user_version").getInt();
  if (schema != kStoreSchema)
    throw ConfigError(fmt::format("{}: has schema version {}, this program reads {}", file_, schema,
                                  kStoreSchema));
  const std::string check = db_->execAndGet("PRAGMA quick_check(1)").getString();
  if (check != "ok") FailDamaged(system::OneLineOf(check));
  // What reading these would do is their maker's choice.
  ForEachRow(
      "SELECT type || ' ' || name FROM sqlite_master WHERE sql LIKE 'CREATE VIRTUAL%' OR "
      "(type NOT IN ('table', 'index') AND name <> 'results')",
      [&](auto& row) {
        throw ConfigError(file_ + ": is no result file of this program: it has a " +
                          row.getColumn(0).getString());
      });
  std::map<std::string, std::string> meta;
  ForEachRow("SELECT key, value FROM meta",
             [&](auto& row) { meta[row.getColumn(0).getString()] = row.getColumn(1).getString(); });
  const auto get = [&](const char* key) {
    if (!meta.contains(key)) FailDamaged(std::string("it has no ") + key);
    if (system::FirstNoText(meta[key])) FailDamaged(std::string(key) + " is no text");
    return meta[key];
  };
  header_ = {.kind = get("kind"),
             .plan = get("plan"),
             .build = get("build"),
             .shard = {},
             .keys = KeysIn(*db_)};
  const double trials = report::NumberIn(get("trials")).value_or(-1);
  if (!(trials >= 0 && trials <= kMaxTrials))
    FailDamaged("its number of trials is '" + get("trials") + "'");
  header_.trials = static_cast<int64_t>(trials);
  if (get("plan_hash") != header_.plan_hash())
    FailDamaged("its plan is not the one that it was begun with");
  try {
    header_.shard = ParseShard(get("shard"));
    RuleOf(header_);
  } catch (const ConfigError& error) {
    FailDamaged(error.what());
  }
  RequireRows();
}

void ResultStore::RequireRows() const {
  const bool is_batch = header_.kind == "batch";
  const TrialRule rule = RuleOf(header_);
  ForEachRow(
      "SELECT trial, typeof(cell) = 'integer' AND typeof(sample) = 'integer' FROM trials",
      [&](auto& row) {
        const int64_t trial = row.getColumn(0).getInt64();
        if (trial < 0 || (is_batch && trial >= header_.trials) || row.getColumn(1).getInt() == 0)
          FailDamaged(fmt::format("trial {} is none of its plan's", trial));
        if (is_batch && !IsOf(header_.shard, rule, trial))
          FailDamaged(fmt::format("trial {} is none of its shard's", trial));
      });
}

void ResultStore::FailDamaged(const std::string& how) const {
  throw ConfigError(file_ + ": is damaged (" + how +
                    "); `sqlite3 FILE .recover` may save some of it");
}

std::map<std::string, Cell> RowOf(const StoredTrial& trial) {
  std::map<std::string, Cell> row = {
      {"trial", trial.trial}, {"cell", trial.cell}, {"sample", trial.sample}};
  const std::vector<Cell> cells = trial::CellsOf(trial.record);
  for (size_t i = 0; i < cells.size(); ++i) row[trial::Columns()[i].name] = cells[i];
  for (const Parameter& parameter : trial.parameters) row[parameter.key] = ValueOf(parameter);
  return row;
}

void ResultStore::Add(const StoredTrial& trial) {
  TD_CHECK(lock_, "a store that was opened for writing");
  TD_CHECK(trial.parameters.size() == header_.keys.size(), "a value for each key");
  Guard(file_, [&] {
    SQLite::Transaction transaction(*db_, SQLite::TransactionBehavior::IMMEDIATE);
    std::map<std::string, Cell> row = RowOf(trial);
    std::vector<std::string> columns;
    std::vector<Cell> cells;
    for (const auto& [name, cell] : row) {
      columns.push_back(name);
      cells.push_back(cell);
    }
    Insert(*db_, "trials", columns).Run(cells);
    if (trial.series.rows() > 0) AddSeries(trial.trial, trial.series);
    transaction.commit();
  });
}

void ResultStore::AddSeriesColumns(const std::vector<std::string>& columns) {
  const std::vector<std::string> there = ColumnsIn(*db_, "series");
  for (const std::string& column : columns)
    if (std::ranges::find(there, column) == there.end())
      db_->exec("ALTER TABLE series ADD COLUMN " + Quoted(column));
}

void ResultStore::AddSeries(int64_t trial, const trial::Series& series) {
  std::vector<std::string> columns = series.names();
  AddSeriesColumns(columns);
  columns.emplace_back("trial");
  Insert insert(*db_, "series", columns);
  std::vector<Cell> row(columns.size(), Cell(trial));
  for (size_t i = 0; i < series.rows(); ++i) {
    for (size_t k = 0; k + 1 < columns.size(); ++k) row[k] = series.At(i, k);
    insert.Run(row);
  }
}

void ResultStore::Merge(const std::string& other_file) {
  TD_CHECK(lock_, "a store that was opened for writing");
  const ResultStore other = Read(other_file);
  const std::vector<std::string> differences = Differences(header_, other.header());
  if (!differences.empty()) throw MismatchError(other_file + ": " + differences[0]);
  Guard(file_, [&] {
    SQLite::Statement attach(*db_, "ATTACH DATABASE ? AS other");
    attach.bind(1, other_file);
    attach.exec();
    {
      SQLite::Transaction transaction(*db_, SQLite::TransactionBehavior::IMMEDIATE);
      SQLite::Statement clash(
          *db_,
          "SELECT a.trial, a.outcome, a.digest, b.outcome, b.digest FROM main.trials a "
          "JOIN other.trials b USING (trial) "
          "WHERE a.digest <> b.digest OR a.outcome <> b.outcome LIMIT 1");
      if (clash.executeStep())
        throw MismatchError(
            fmt::format("{}: trial {} ended {} with digest {} here and {} with digest {} there",
                        other_file, clash.getColumn(0).getInt64(), clash.getColumn(1).getString(),
                        clash.getColumn(2).getString(), clash.getColumn(3).getString(),
                        clash.getColumn(4).getString()));
      // `series` first: which trials are new shows in `trials`.
      for (const std::string table : {"series", "trials"}) {
        std::vector<std::string> columns = ColumnsIn(*other.db_, table);
        if (table == "series") AddSeriesColumns(columns);
        columns.emplace_back("trial");
        db_->exec(
            fmt::format("INSERT INTO main.{0} ({1}) SELECT {1} FROM other.{0} "
                        "WHERE trial NOT IN (SELECT trial FROM main.trials)",
                        table, QuotedList(columns)));
      }
      transaction.commit();
    }
    db_->exec("DETACH DATABASE other");
  });
}

std::vector<int64_t> ResultStore::Numbers(const std::string& query) const {
  std::vector<int64_t> numbers;
  ForEachRow(query, [&](auto& row) { numbers.push_back(row.getColumn(0).getInt64()); });
  return numbers;
}

std::vector<int64_t> ResultStore::Done() const {
  return Numbers("SELECT trial FROM trials ORDER BY trial");
}

std::vector<int64_t> ResultStore::TrialsWithSeries() const {
  return Numbers("SELECT DISTINCT trial FROM series ORDER BY trial");
}

std::vector<Verdict> ResultStore::Verdicts() const {
  std::vector<Verdict> verdicts;
  ForEachRow(fmt::format("SELECT trial, failure = '{}' FROM trials ORDER BY trial",
                         NameOf(trial::Failure::kNone)),
             [&](auto& row) {
               verdicts.push_back({row.getColumn(0).getInt64(), row.getColumn(1).getInt() != 0});
             });
  return verdicts;
}

std::vector<StoredTrial> ResultStore::Trials() const { return Select(""); }

StoredTrial ResultStore::Trial(int64_t trial) const {
  std::vector<StoredTrial> found = Select(fmt::format("WHERE trial = {}", trial));
  if (found.empty()) throw ConfigError(fmt::format("{}: has no trial {}", file_, trial));
  return std::move(found[0]);
}

trial::Series ResultStore::SeriesOf(int64_t trial) const {
  std::vector<std::string> columns = Guard(file_, [&] { return ColumnsIn(*db_, "series"); });
  // Those of other vehicles' thrusters are empty.
  std::erase_if(columns, [&](const std::string& column) {
    return column.ends_with("_v") &&
           !Numbers(fmt::format(
                        "SELECT 1 FROM series WHERE trial = {} GROUP BY trial HAVING count({}) = 0",
                        trial, Quoted(column)))
                .empty();
  });
  trial::Series series;
  try {
    series = trial::Series::WithColumns(columns);
    columns = series.names();
    ForEachRow(fmt::format("SELECT {} FROM series WHERE trial = {} ORDER BY frame",
                           QuotedList(columns), trial),
               [&](auto& row) {
                 for (size_t i = 0; i < columns.size(); ++i)
                   series.Add(i, CellIn(row.getColumn(static_cast<int>(i))));
               });
  } catch (const ConfigError& error) {
    FailDamaged(fmt::format("series of trial {}: {}", trial, error.what()));
  }
  return series;
}

std::vector<StoredTrial> ResultStore::Select(const std::string& where) const {
  std::vector<std::string> columns = {"trial", "cell", "sample"};
  columns.insert(columns.end(), header_.keys.begin(), header_.keys.end());
  for (const trial::Column& column : trial::Columns()) columns.push_back(column.name);
  std::vector<StoredTrial> trials;
  ForEachRow(fmt::format("SELECT {} FROM trials {} ORDER BY trial", QuotedList(columns), where),
             [&](SQLite::Statement& row) {
               StoredTrial& stored = trials.emplace_back();
               int at = 0;
               for (int64_t* number : {&stored.trial, &stored.cell, &stored.sample})
                 *number = row.getColumn(at++).getInt64();
               for (const std::string& key : header_.keys)
                 stored.parameters.push_back({key, TextOf(CellIn(row.getColumn(at++)))});
               std::vector<Cell> cells(trial::Columns().size());
               for (Cell& cell : cells) cell = CellIn(row.getColumn(at++));
               try {
                 stored.record = trial::RecordOf(cells);
               } catch (const ConfigError& error) {
                 FailDamaged(fmt::format("trial {}: {}", stored.trial, error.what()));
               }
             });
  return trials;
}

}  // namespace turbidock::batch
