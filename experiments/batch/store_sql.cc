#include "experiments/batch/store_sql.h"

#include <fcntl.h>
#include <fmt/ranges.h>
#include <sqlite3.h>
#include <unistd.h>

#include <boost/algorithm/string/replace.hpp>
#include <cerrno>
#include <cstring>

#include "experiments/trial/record_columns.h"

namespace turbidock::batch {
namespace {

// A lock of the open file description: it ends when the last process that has the file open does.
// Unlike flock's, it works on network file systems and can be asked for without taking it. It is on
// a byte far behind those that SQLite locks.
struct flock FarByte() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = off_t{1} << 62;
  lock.l_len = 1;
  return lock;
}

}  // namespace

RunLock::RunLock(const std::string& file)
    : fd_(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
  if (fd_ < 0) throw ConfigError(file + ": cannot be written: " + std::strerror(errno));
  struct flock lock = FarByte();
  if (fcntl(fd_, F_OFD_SETLK, &lock) == 0) return;
  const int problem = errno;
  close(fd_);
  throw ConfigError(file + (problem == EAGAIN || problem == EACCES
                                ? ": another run is writing to this file"
                                : std::string(": cannot be locked: ") + std::strerror(problem)));
}

RunLock::~RunLock() { close(fd_); }

bool IsLocked(const std::string& file) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  struct flock lock = FarByte();
  const bool locked = fcntl(fd, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  close(fd);
  return locked;
}

std::string Quoted(const std::string& name) {
  return "\"" + boost::replace_all_copy(name, "\"", "\"\"") + "\"";
}

std::string QuotedList(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + Quoted(name);
  return list;
}

std::vector<std::string> KeysIn(const SQLite::Database& db) {
  std::vector<std::string> names;
  SQLite::Statement query(db, "SELECT name FROM pragma_table_info('trials') WHERE type = ''");
  while (query.executeStep()) names.push_back(query.getColumn(0).getString());
  return names;
}

void CreateTables(const std::vector<std::string>& keys, SQLite::Database* db) {
  std::string columns =
      "trial INTEGER PRIMARY KEY, cell INTEGER NOT NULL, sample INTEGER NOT NULL, identity TEXT "
      "NOT NULL";
  std::string results = "trial, cell, sample";
  const auto add = [&](const std::string& name, const char* type, bool is_result) {
    columns += ", " + Quoted(name) + " " + type;
    if (is_result) results += ", " + Quoted(name);
  };
  for (const std::string& key : keys) add(key, "", true);  // of no type
  for (const trial::Column& column : trial::Columns())
    add(column.name, column.sql_type, column.storage != trial::Storage::kRun);
  db->exec("CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID");
  db->exec(fmt::format("CREATE TABLE trials ({})", columns));
  db->exec("CREATE TABLE series (trial INTEGER PRIMARY KEY, bytes BLOB NOT NULL)");
  db->exec(
      "CREATE TABLE outputs (job INTEGER PRIMARY KEY, input_digest TEXT NOT NULL, output TEXT NOT "
      "NULL)");
  db->exec(fmt::format("CREATE VIEW results AS SELECT {} FROM trials", results));
}

const char* ProblemOf(const SQLite::Exception& error) {
  if (error.getExtendedErrorCode() == SQLITE_READONLY_DBMOVED)
    return "was removed or renamed while trials were being stored; nothing more is stored";
  switch (error.getErrorCode()) {
    case SQLITE_FULL:
      return "cannot be written, the disk is full; the trials stored so far are safe, and starting "
             "again goes on from there";
    case SQLITE_IOERR:
      return "cannot be read or written; the trials stored so far are safe";
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return "cannot be written, it is read-only";
    case SQLITE_CANTOPEN:
      return "cannot be opened";
    case SQLITE_NOTADB:
      return "is no result file";
    case SQLITE_ERROR:  // "no such column"
      return "is no result file of this program";
    case SQLITE_CORRUPT:
      return "is damaged; `sqlite3 FILE .recover` may save some of it";
    case SQLITE_BUSY:
      return "is locked by another program";
    default:
      return "a database error";
  }
}

void Harden(const SQLite::Database& db) {
  constexpr int kLongestValue = 256 << 20;  // bytes, of a plan
  sqlite3* const handle = db.getHandle();
  sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_DQS_DML, 0, nullptr);  // "no_column" is no text
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, kLongestValue);
  sqlite3_exec(handle, "PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0", nullptr, nullptr,
               nullptr);
}

trial::Cell CellIn(const SQLite::Column& column) {
  if (column.isInteger()) return column.getInt64();
  if (column.isFloat()) return column.getDouble();
  return column.isNull() ? trial::Cell() : trial::Cell(column.getString());
}

void InsertRow(const SQLite::Database& db, const std::string& table,
               const std::vector<std::string>& columns, const std::vector<trial::Cell>& cells) {
  SQLite::Statement insert(
      db, fmt::format("INSERT INTO {} ({}) VALUES ({})", table, QuotedList(columns),
                      fmt::join(std::vector<const char*>(columns.size(), "?"), ", ")));
  int at = 0;
  for (const trial::Cell& cell : cells) {
    ++at;
    if (cell.is_number_float())
      insert.bind(at, cell.get<double>());
    else if (cell.is_boolean())
      insert.bind(at, cell.get<bool>() ? 1 : 0);
    else if (cell.is_number())
      insert.bind(at, cell.get<int64_t>());
    else if (cell.is_string())
      insert.bind(at, cell.get_ref<const std::string&>());
    else
      insert.bind(at);
  }
  insert.exec();
}

}  // namespace turbidock::batch
