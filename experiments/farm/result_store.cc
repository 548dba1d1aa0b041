#include "experiments/farm/result_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "experiments/config/yaml_fields.h"
#include "experiments/farm/store_schema.h"
#include "experiments/farm/store_sql.h"
#include "experiments/farm/trial_scheduler.h"
#include "experiments/report/table.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "experiments/trial/record_columns.h"

namespace turbidock::farm {
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
  RequireSchema(*db_, file_);
  const auto get = [&](const std::string& key) {
    SQLite::Statement query(*db_, "SELECT value FROM meta WHERE key = ?");
    query.bind(1, key);
    if (!query.executeStep()) FailDamaged("it has no " + key);
    std::string value = query.getColumn(0).getString();
    if (system::FirstNoText(value)) FailDamaged(key + " is no text");
    return value;
  };
  header_.kind = get("kind");
  header_.plan = get("plan");
  header_.build = get("build");
  try {
    header_.shard = ParseShard(get("shard"));
  } catch (const ConfigError&) {
    FailDamaged("its shard is '" + get("shard") + "'");
  }
  const double trials = report::NumberIn(get("trials")).value_or(-1);
  if (!(trials >= 0 && trials <= kMaxTrials))
    FailDamaged("its number of trials is '" + get("trials") + "'");
  header_.trials = static_cast<int64_t>(trials);
  if (get("plan_hash") != header_.plan_hash())
    FailDamaged("its plan is not the one that it was begun with");
  try {
    RuleOf(header_);
  } catch (const ConfigError& error) {
    FailDamaged(error.what());
  }
  header_.keys = OwnColumns(*db_, "parameters");
  RequireRows();
}

void ResultStore::RequireRows() const {
  for (const char* table : {"runs", "parameters", "metrics"}) {
    SQLite::Statement query(*db_, fmt::format("SELECT trial FROM trials WHERE trial NOT IN "
                                              "(SELECT trial FROM {}) LIMIT 1",
                                              table));
    if (query.executeStep())
      FailDamaged(fmt::format("trial {} is not in table {}", query.getColumn(0).getInt64(), table));
  }
  const bool is_batch = header_.kind == "batch";
  const TrialRule rule = RuleOf(header_);
  SQLite::Statement query(*db_,
                          "SELECT trial, typeof(cell) = 'integer' AND typeof(sample) = 'integer' "
                          "FROM trials");
  while (query.executeStep()) {
    const int64_t trial = query.getColumn(0).getInt64();
    if (trial < 0 || (is_batch && trial >= header_.trials) || query.getColumn(1).getInt() == 0)
      FailDamaged(fmt::format("trial {} is none of its plan's", trial));
    if (is_batch && !IsOf(header_.shard, rule, trial))
      FailDamaged(fmt::format("trial {} is none of its shard's", trial));
  }
}

void ResultStore::FailDamaged(const std::string& how) const {
  throw ConfigError(file_ + ": is damaged (" + how +
                    "); `sqlite3 FILE .recover` may save some of it");
}

void ResultStore::Add(const StoredTrial& trial) {
  TD_CHECK(lock_, "a store that was opened for writing");
  TD_CHECK(trial.parameters.size() == header_.keys.size(), "a value for each key");
  Guard(file_, [&] {
    SQLite::Transaction transaction(*db_, SQLite::TransactionBehavior::IMMEDIATE);
    const std::vector<Cell> cells = trial::CellsOf(trial.record);
    for (const RecordTable& table : RecordTables()) {
      std::vector<std::string> columns;
      std::vector<Cell> row;
      if (table.name == kTrialsTable) {
        columns = {"cell", "sample"};
        row = {trial.cell, trial.sample};
      }
      for (const size_t i : table.columns) {
        columns.push_back(trial::Columns()[i].name);
        row.push_back(cells[i]);
      }
      TrialInsert(*db_, table.name, columns).Run(trial.trial, row);
    }
    std::vector<Cell> values;
    for (const Parameter& parameter : trial.parameters) values.push_back(ValueOf(parameter));
    TrialInsert(*db_, "parameters", header_.keys).Run(trial.trial, values);
    if (trial.series.rows() > 0) AddSeries(trial.trial, trial.series);
    transaction.commit();
  });
}

void ResultStore::AddSeriesColumns(const std::vector<std::string>& columns) {
  const std::vector<std::string> there = OwnColumns(*db_, "series");
  for (const std::string& column : columns)
    if (std::ranges::find(there, column) == there.end())
      db_->exec("ALTER TABLE series ADD COLUMN " + Quoted(column));
}

void ResultStore::AddSeries(int64_t trial, const trial::Series& series) {
  const std::vector<std::string> columns = series.names();
  AddSeriesColumns(columns);
  TrialInsert insert(*db_, "series", columns);
  std::vector<Cell> row(columns.size());
  for (size_t i = 0; i < series.rows(); ++i) {
    for (size_t k = 0; k < columns.size(); ++k) row[k] = series.At(i, k);
    insert.Run(trial, row);
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
      // Children first: which trials are new shows in `trials`.
      for (const std::string table : kTables) {
        const std::vector<std::string> own = OwnColumns(*other.db_, table);
        if (table == "series") AddSeriesColumns(own);
        const std::string columns = "trial" + QuotedList(own);
        db_->exec(
            fmt::format("INSERT INTO main.{0} ({1}) SELECT {1} FROM other.{0} "
                        "WHERE trial NOT IN (SELECT trial FROM main.trials)",
                        table, columns));
      }
      transaction.commit();
    }
    db_->exec("DETACH DATABASE other");
  });
}

std::vector<int64_t> ResultStore::Done() const {
  return Guard(file_, [&] {
    std::vector<int64_t> done;
    SQLite::Statement query(*db_, "SELECT trial FROM trials ORDER BY trial");
    while (query.executeStep()) done.push_back(query.getColumn(0).getInt64());
    return done;
  });
}

std::vector<Verdict> ResultStore::Verdicts() const {
  return Guard(file_, [&] {
    std::vector<Verdict> verdicts;
    SQLite::Statement query(*db_, "SELECT trial, failure = ? FROM trials ORDER BY trial");
    query.bind(1, NameOf(trial::Failure::kNone));
    while (query.executeStep())
      verdicts.push_back({query.getColumn(0).getInt64(), query.getColumn(1).getInt() != 0});
    return verdicts;
  });
}

std::vector<StoredTrial> ResultStore::Trials() const { return Select(""); }

StoredTrial ResultStore::Trial(int64_t trial) const {
  std::vector<StoredTrial> found = Select(fmt::format("WHERE trials.trial = {}", trial));
  if (found.empty()) throw ConfigError(fmt::format("{}: has no trial {}", file_, trial));
  return std::move(found[0]);
}

std::vector<int64_t> ResultStore::TrialsWithSeries() const {
  return Guard(file_, [&] {
    std::vector<int64_t> trials;
    SQLite::Statement query(*db_, "SELECT DISTINCT trial FROM series ORDER BY trial");
    while (query.executeStep()) trials.push_back(query.getColumn(0).getInt64());
    return trials;
  });
}

trial::Series ResultStore::SeriesOf(int64_t trial) const {
  return Guard(file_, [&] {
    std::vector<std::string> columns = OwnColumns(*db_, "series");
    // Those of other vehicles' thrusters are empty.
    std::erase_if(columns, [&](const std::string& column) {
      if (!column.ends_with("_v")) return false;
      SQLite::Statement any(
          *db_,
          fmt::format("SELECT count({}), count(*) FROM series WHERE trial = ?", Quoted(column)));
      any.bind(1, trial);
      any.executeStep();
      return any.getColumn(0).getInt64() == 0 && any.getColumn(1).getInt64() > 0;
    });
    trial::Series series = trial::Series::WithColumns(columns);
    columns = series.names();
    SQLite::Statement query(
        *db_, "SELECT trial" + QuotedList(columns) + " FROM series WHERE trial = ? ORDER BY frame");
    query.bind(1, trial);
    try {
      while (query.executeStep())
        for (size_t i = 0; i < columns.size(); ++i)
          series.Add(i, CellIn(query.getColumn(static_cast<int>(i) + 1)));
    } catch (const ConfigError& error) {
      FailDamaged(fmt::format("series of trial {}: {}", trial, error.what()));
    }
    return series;
  });
}

std::vector<StoredTrial> ResultStore::Select(const std::string& where) const {
  return Guard(file_, [&] {
    std::string wanted = "trials.trial, trials.cell, trials.sample";
    for (const std::string& key : header_.keys) wanted += ", parameters." + Quoted(key);
    for (const RecordTable& table : RecordTables())
      for (const size_t i : table.columns)
        wanted += fmt::format(", {}.{}", table.name, Quoted(trial::Columns()[i].name));
    SQLite::Statement query(*db_, "SELECT " + wanted +
                                      " FROM trials JOIN runs USING (trial) JOIN parameters "
                                      "USING (trial) JOIN metrics USING (trial) " +
                                      where + " ORDER BY trials.trial");
    std::vector<StoredTrial> trials;
    while (query.executeStep()) {
      StoredTrial stored;
      int at = 0;
      const auto next = [&] { return query.getColumn(at++); };
      stored.trial = next().getInt64();
      stored.cell = next().getInt64();
      stored.sample = next().getInt64();
      for (const std::string& key : header_.keys)
        stored.parameters.push_back({key, TextOf(CellIn(next()))});
      std::vector<Cell> cells(trial::Columns().size());
      for (const RecordTable& table : RecordTables())
        for (const size_t i : table.columns) cells[i] = CellIn(next());
      try {
        stored.record = trial::RecordOf(cells);
      } catch (const ConfigError& error) {
        FailDamaged(fmt::format("trial {}: {}", stored.trial, error.what()));
      }
      trials.push_back(std::move(stored));
    }
    return trials;
  });
}

}  // namespace turbidock::farm
