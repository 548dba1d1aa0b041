#pragma once
// A trial's log as typed columns: what a worker sends, a batch's file stores, a page and Python
// show and trajectory.csv holds. The columns, their order and their types are one list in
// series.cc.
//
//   const Series series = Series::Of(result.log, /*every_frames=*/30);
//   system::WriteWhole("trajectory.csv", series.Csv());

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "control/stage.h"
#include "experiments/report/json.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/trial_record.h"

namespace turbidock::trial {

class Series {
 public:
  using Values =
      std::variant<std::vector<int64_t>, std::vector<double>, std::vector<control::Stage>>;
  struct Column {
    std::string name;  // in snake_case, with its unit
    Values values;     // one a row
  };

  Series() = default;  // without columns: of no log
  // Without rows, with a column for each thruster.
  explicit Series(const std::vector<std::string>& thrusters);
  // A row for every n-th frame, from the first on; its contacts are the strongest until the next.
  static Series Of(const TrialLog& log, int every_frames = 1);
  const std::vector<Column>& columns() const { return columns_; }
  std::vector<std::string> names() const;
  size_t rows() const;
  Cell At(size_t row, size_t column) const;
  // The rows from that one on.
  Series From(size_t row) const;

  // A column of numbers by its name; the stage of each row, and whether it follows what is desired.
  const std::vector<double>& Numbers(const std::string& name) const;
  const std::vector<control::Stage>& stages() const;
  const std::vector<int64_t>& controlled() const;
  // The names of the thrusters' columns.
  std::vector<std::string> voltages() const;

  // A row more, of the same thrusters.
  void Add(const FrameRecord& frame);

  // As trajectory.csv has it: names, then a line a row. Numbers read back exactly.
  std::string Csv() const;
  // Columns in any order. ConfigError "WHERE: ..." for a text that is none.
  static Series FromCsv(const std::string& text, const std::string& where);

  // As a batch's file and a page hold it: a line of JSON, {"rows": 7, "columns": [["frame", "int"],
  // ["time_s", "double"], ["stage", ["approach", ...]], ...]}, then each column: the least
  // significant byte of every row, the next one of every row, and so on; a word is one byte, its
  // place in the list. Numbers read back exactly.
  std::string Bytes() const;
  // ConfigError for bytes that are none, or of another program.
  static Series FromBytes(std::string_view bytes);
  // With so many digits of each number, at least; the rest of its bits are zero and pack well.
  Series Rounded(int digits) const;

 private:
  static Series Of(const std::vector<std::string>& names);
  template <class V>
  const std::vector<V>& ColumnOf(const std::string& name) const;

  std::vector<Column> columns_;
};

}  // namespace turbidock::trial
