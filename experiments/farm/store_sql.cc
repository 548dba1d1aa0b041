#include "experiments/farm/store_sql.h"

#include <sqlite3.h>

#include "experiments/farm/store_schema.h"

namespace turbidock::farm {

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

TrialInsert::TrialInsert(const SQLite::Database& db, const std::string& table,
                         const std::vector<std::string>& columns)
    : statement_(db,
                 fmt::format("INSERT INTO {} (trial{}) VALUES ({})", table, QuotedList(columns),
                             fmt::join(std::vector<const char*>(1 + columns.size(), "?"), ", "))) {}

void TrialInsert::Run(int64_t trial, const std::vector<trial::Cell>& cells) {
  statement_.reset();
  statement_.bind(1, trial);
  for (int i = 0; i < std::ssize(cells); ++i) {
    const trial::Cell& cell = cells[static_cast<size_t>(i)];
    if (cell.is_number_float())
      statement_.bind(i + 2, cell.get<double>());
    else if (cell.is_boolean())
      statement_.bind(i + 2, cell.get<bool>() ? 1 : 0);
    else if (cell.is_number())
      statement_.bind(i + 2, cell.get<int64_t>());
    else if (cell.is_string())
      statement_.bind(i + 2, cell.get_ref<const std::string&>());
    else
      statement_.bind(i + 2);
  }
  statement_.exec();
}

}  // namespace turbidock::farm
