#pragma once
// Tables of numbers as CSV: recorded commands, currents, motion.

#include <string>
#include <vector>

namespace turbidock::config {

struct NumberTable {
  std::vector<std::string> names;            // of the columns, each with its unit
  std::vector<std::vector<double>> columns;  // NaN where nothing is

  size_t rows() const { return columns.empty() ? 0 : columns[0].size(); }
  // The column of that name, null where there is none.
  const std::vector<double>* Find(const std::string& name) const;
  // A line of names, then a line a row; numbers read back exactly.
  std::string Csv() const;
};

// Reads such a file; words in it (a trial's stages) are NaN. ConfigError "FILE:LINE: ..." for a row
// of another length, a name given twice, a file without rows.
NumberTable ReadNumberTable(const std::string& file);

// The column time_s. ConfigError "FILE:LINE: ..." where it is missing, no number, or runs
// backwards.
const std::vector<double>& TimesOf(const NumberTable& table, const std::string& file);

// Where a row is found: "FILE:LINE".
std::string PlaceOf(const std::string& file, size_t row);

}  // namespace turbidock::config
