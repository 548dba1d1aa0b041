#include "experiments/batch/result_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "experiments/batch/store_sql.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/table.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "experiments/trial/record_columns.h"

namespace turbidock::batch {
namespace {

using trial::Cell;

constexpr int kApplicationId = 0x54444f4b;  // "TDOK": tells our files from other SQLite databases
constexpr int kBusyTimeout_ms = 20000;      // a reader or a writer holds the file for milliseconds

// A parameter's.
std::string TextOf(const Cell& cell) {
  if (cell.is_string()) return cell.get<std::string>();
  return cell.is_null() ? "" : FormatNumber(cell.get<double>());
}

// Empty where it is no text.
std::string FolderOf(const std::string& file) {
  const std::string folder =
      std::filesystem::absolute(file).lexically_normal().parent_path().string();
  return system::FirstNoText(folder) ? "" : folder;
}

}  // namespace

TrialRule RuleOf(const StoreHeader& header) {
  TrialRule rule{.batch = header.trials, .most = header.trials, .precision = {}};
  if (!header.is_of_plan()) return rule;
  const config::YamlNode plan = config::ParseYaml(header.plan, "plan");
  if (const auto strata = plan.Find("strata"))
    rule.strata = std::max<int64_t>(1, std::ssize(strata->Entries()));
  if (const auto envelope = ReadEnvelope(plan)) {
    if (header.trials % (kMostOfCell * envelope->points()) != 0)
      throw ConfigError("its plan's ranges do not go together with its number of trials");
    return {.cells = header.trials / kMostOfCell,
            .most = kMostOfCell,
            .precision = {},
            .search = envelope->Search()};
  }
  int64_t seeds = 1;
  double precision = 0;
  if (const auto given = plan.Find("seeds")) config::ReadValue(*given, &seeds);
  if (const auto given = plan.Find("precision")) config::ReadValue(*given, &precision);
  const int64_t samples = seeds < 1 ? 0 : SamplesOf(seeds, precision);
  if (samples < 1 || seeds % rule.strata != 0 || header.trials < samples ||
      header.trials % samples != 0)
    throw ConfigError(
        "its plan's seeds, precision and strata do not go together with its number of trials");
  if (precision > 0)
    rule = {.cells = header.trials / samples,
            .batch = seeds,
            .most = samples,
            .precision = precision,
            .strata = rule.strata};
  return rule;
}

bool IsOf(const Shard& shard, const TrialRule& rule, int64_t trial) {
  return shard.Has(rule.precision || rule.search ? rule.unit_of(trial % rule.cells)
                                                 : trial / rule.strata);
}

Cell ValueOf(const Parameter& parameter) {
  static const std::set<std::string> texts = [] {
    std::set<std::string> keys = {"scenario", "case", kStratumKey};
    for (const config::KeyDoc& doc : trial::ScenarioKeys())
      if (doc.type == "text" || doc.type == "file" || doc.type.starts_with("one of"))
        keys.insert(doc.key);
    return keys;
  }();
  const std::string& text = parameter.value;
  const std::optional<double> number = report::NumberIn(text);
  if (!number || !std::isfinite(*number) || texts.contains(parameter.key)) return text;
  int64_t whole = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), whole);
  if (error == std::errc() && end == text.data() + text.size()) return whole;
  return *number;
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
    system::MakeFolderOf(file_);
    system::RequireWritable(file_, system::kResultFile);  // SQLite would open it for reading
    lock_ = std::make_unique<RunLock>(file_);
  }
  Guard(file_, [&] {
    // Reading, too, must be able to undo what a killed writer left half done; else nothing is
    // written. Where that is not allowed SQLite opens a file for reading.
    const int mode = SQLite::OPEN_READWRITE | (writes ? SQLite::OPEN_CREATE : 0);
    db_ = std::make_unique<SQLite::Database>(file_, mode, kBusyTimeout_ms);
    Harden(*db_);
    if (!writes) return;
    // A rollback journal, not a write-ahead log: the file alone is the whole result, and it works
    // on a cluster's network file system. EXTRA: on the disk before a transaction counts as done.
    db_->exec("PRAGMA journal_mode = DELETE; PRAGMA synchronous = EXTRA");
  });
}

ResultStore ResultStore::Open(const std::string& file, const StoreHeader& header) {
  ResultStore store(file, /*writes=*/true);
  Guard(file, [&] {
    const int tables = store.db_->execAndGet("SELECT count(*) FROM sqlite_master").getInt();
    if (tables == 0) store.Create(header);
    store.ReadHeader();
  });
  const StoreHeader& there = store.header_;
  if (there.kind != header.kind) throw OtherResults(file, DifferenceOf(there, header), "");
  if (there.shard != header.shard)
    throw OtherResults(
        file, "the file has shard " + there.shard.Text() + ", this is shard " + header.shard.Text(),
        "");
  return store;
}

ResultStore ResultStore::Write(const std::string& file, const StoreHeader& header) {
  ResultStore store = Open(file, header);
  const std::string difference = DifferenceOf(store.header_, header);
  if (difference.empty()) return store;
  // what is no trial is not run anew
  if (header.keys.empty()) throw OtherResults(file, difference, " or finish it as it was begun");
  throw OtherResults(file, difference);
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
  WriteMeta(header);
  transaction.commit();
}

void ResultStore::WriteMeta(const StoreHeader& header) {
  db_->exec("DELETE FROM meta");
  for (const auto& [key, value] :
       std::map<std::string, std::string>{{"schema_version", std::to_string(kStoreSchema)},
                                          {"kind", header.kind},
                                          {"plan", header.plan},
                                          {"plan_hash", header.plan_hash()},
                                          {"build", header.build},
                                          {"code", header.code},
                                          {"shard", header.shard.Text()},
                                          {"trials", std::to_string(header.trials)},
                                          {"folder", FolderOf(file_)}})
    InsertRow(*db_, "meta", {"key", "value"}, {key, value});
}

std::string ResultStore::PlanHere() const {
  return PlanMoved(header_.plan, begun_in_, FolderOf(file_));
}

void ResultStore::Become(const StoreHeader& header, const std::vector<Renumbered>& numbers) {
  Guard(file_, [&] {
    SQLite::Transaction transaction(*db_, SQLite::TransactionBehavior::IMMEDIATE);
    // All numbers at once, by way of those below zero, which no trial has.
    db_->exec("UPDATE trials SET trial = -1 - trial; UPDATE series SET trial = -1 - trial");
    for (const auto& [before, trial, cell] : numbers) {
      db_->exec(fmt::format("UPDATE trials SET trial = {}, cell = {} WHERE trial = {}", trial, cell,
                            -1 - before));
      db_->exec(fmt::format("UPDATE series SET trial = {} WHERE trial = {}", trial, -1 - before));
    }
    db_->exec("DELETE FROM trials WHERE trial < 0; DELETE FROM series WHERE trial < 0");
    // Columns are named by what varies; no trial is kept where that is another.
    if (header.keys != header_.keys) {
      db_->exec("DROP VIEW results");
      for (const char* table : {"meta", "trials", "series", "outputs"})
        db_->exec(fmt::format("DROP TABLE {}", table));
      CreateTables(header.keys, db_.get());
    }
    WriteMeta(header);
    transaction.commit();
  });
  header_ = header;
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
  begun_in_ = get("folder");
  header_ = {.kind = get("kind"),
             .plan = get("plan"),
             .build = get("build"),
             .code = get("code"),
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
  const TrialRule rule = RuleOf(header_);
  ForEachRow("SELECT trial, typeof(cell) = 'integer' AND typeof(sample) = 'integer' FROM trials",
             [&](auto& row) {
               const int64_t trial = row.getColumn(0).getInt64();
               const bool is_planned = !header_.is_of_plan() ||
                                       (trial < header_.trials && IsOf(header_.shard, rule, trial));
               if (trial < 0 || !is_planned || row.getColumn(1).getInt() == 0)
                 FailDamaged(fmt::format("trial {} is none of its plan's and shard's", trial));
             });
}

void ResultStore::FailDamaged(const std::string& how) const {
  throw ConfigError(file_ + ": is damaged (" + how +
                    "); `sqlite3 FILE .recover` may save some of it");
}

// Of the table `trials`, as this program reads and writes them.
std::vector<std::string> ResultStore::TrialColumns() const {
  std::vector<std::string> columns = {"trial", "cell", "sample", "identity"};
  columns.insert(columns.end(), header_.keys.begin(), header_.keys.end());
  for (const trial::Column& column : trial::Columns()) columns.push_back(column.name);
  return columns;
}

void ResultStore::Insert(const StoredTrial& trial) {
  TD_CHECK(lock_, "a store that was opened for writing");
  TD_CHECK(trial.parameters.size() == header_.keys.size(), "a value for each key");
  std::vector<Cell> row = {trial.trial, trial.cell, trial.sample, trial.identity};
  for (const Parameter& parameter : trial.parameters) row.push_back(ValueOf(parameter));
  std::ranges::copy(trial::CellsOf(trial.record), std::back_inserter(row));
  InsertRow(*db_, "trials", TrialColumns(), row);
  if (trial.series.rows() > 0) InsertSeries(trial);
}

void ResultStore::InsertSeries(const StoredTrial& trial) {
  SQLite::Statement insert(*db_, "INSERT INTO series (trial, bytes) VALUES (?, ?)");
  const std::string bytes = trial.series.Bytes();
  insert.bind(1, trial.trial);
  insert.bindNoCopy(2, bytes.data(), static_cast<int>(bytes.size()));
  insert.exec();
}

void ResultStore::Add(const StoredTrial& trial) {
  Guard(file_, [&] {
    SQLite::Transaction transaction(*db_, SQLite::TransactionBehavior::IMMEDIATE);
    Insert(trial);
    transaction.commit();
  });
}

void ResultStore::Merge(const std::string& other_file) {
  const ResultStore other = Read(other_file);
  const std::string difference = DifferenceOf(header_, other.header());
  if (!difference.empty()) throw MismatchError(other_file + ": " + difference);
  std::map<int64_t, trial::TrialRecord> known;
  for (StoredTrial& trial : Trials()) known.emplace(trial.trial, std::move(trial.record));
  Guard(file_, [&] {
    SQLite::Transaction transaction(*db_, SQLite::TransactionBehavior::IMMEDIATE);
    for (StoredTrial& trial : other.Trials()) {
      const trial::TrialRecord& there = trial.record;
      if (const auto here = known.find(trial.trial); here == known.end()) {
        trial.series = other.SeriesOf(trial.trial);
        Insert(trial);
      } else if (here->second.digest != there.digest || here->second.outcome != there.outcome) {
        throw MismatchError(
            fmt::format("{}: trial {} ended {} with digest {} here and {} with digest {} there",
                        other_file, trial.trial, NameOf(here->second.outcome), here->second.digest,
                        NameOf(there.outcome), there.digest));
      }
    }
    transaction.commit();
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
  return Numbers("SELECT trial FROM series ORDER BY trial");
}

void ResultStore::ForEachRenderer(
    const std::function<void(const std::string& renderer, int64_t trial)>& act) const {
  ForEachRow("SELECT renderer, min(trial) FROM trials WHERE renderer <> '' GROUP BY renderer",
             [&](auto& row) { act(row.getColumn(0).getString(), row.getColumn(1).getInt64()); });
}

std::map<int64_t, bool> ResultStore::Successes() const {
  std::map<int64_t, bool> successes;
  ForEachRow(
      fmt::format("SELECT trial, failure = '{}' FROM trials WHERE failure <> '{}'",
                  NameOf(trial::Failure::kNone), NameOf(trial::Failure::kNoAnswer)),
      [&](auto& row) { successes[row.getColumn(0).getInt64()] = row.getColumn(1).getInt() != 0; });
  return successes;
}

std::string ResultStore::Csv(bool timing) const {
  std::string text;
  ForEachRow(fmt::format("SELECT * FROM {} ORDER BY trial", timing ? "trials" : "results"),
             [&](SQLite::Statement& row) {
               report::Json cells;
               for (int i = 0; i < row.getColumnCount(); ++i)
                 cells[row.getColumnName(i)] = CellIn(row.getColumn(i));
               report::AddCsv(cells, &text);
             });
  return text;
}

std::vector<StoredTrial> ResultStore::Trials() const { return Select(""); }

std::optional<StoredTrial> ResultStore::Find(int64_t trial) const {
  std::vector<StoredTrial> found = Select(fmt::format("WHERE trial = {}", trial));
  return found.empty() ? std::nullopt : std::optional(std::move(found[0]));
}

StoredTrial ResultStore::Trial(int64_t trial) const {
  if (auto found = Find(trial)) return *std::move(found);
  throw ConfigError(fmt::format("{}: has no trial {}", file_, trial));
}

trial::Series ResultStore::SeriesOf(int64_t trial) const {
  trial::Series series;
  ForEachRow(fmt::format("SELECT bytes FROM series WHERE trial = {}", trial), [&](auto& row) {
    try {
      series = trial::Series::FromBytes(row.getColumn(0).getString());
    } catch (const ConfigError& error) {
      FailDamaged(fmt::format("series of trial {}: {}", trial, error.what()));
    }
  });
  return series;
}

void ResultStore::AddOutput(int64_t job, const std::string& input, const std::string& output) {
  Guard(file_, [&] {
    InsertRow(*db_, "outputs", {"job", "input_digest", "output"}, {job, DigestOf(input), output});
  });
}

std::optional<std::string> ResultStore::OutputOf(int64_t job, const std::string& input) const {
  std::optional<std::string> output;
  ForEachRow(
      fmt::format("SELECT input_digest, output FROM outputs WHERE job = {}", job), [&](auto& row) {
        if (row.getColumn(0).getString() != DigestOf(input))
          throw MismatchError(
              fmt::format("{}: job {} is not the one that this program would do", file_, job));
        output = row.getColumn(1).getString();
      });
  return output;
}

std::vector<StoredTrial> ResultStore::Select(const std::string& where) const {
  std::vector<StoredTrial> trials;
  ForEachRow(
      fmt::format("SELECT {} FROM trials {} ORDER BY trial", QuotedList(TrialColumns()), where),
      [&](SQLite::Statement& row) {
        StoredTrial& stored = trials.emplace_back();
        int at = 0;
        for (int64_t* number : {&stored.trial, &stored.cell, &stored.sample})
          *number = row.getColumn(at++).getInt64();
        stored.identity = row.getColumn(at++).getString();
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
