#pragma once
// Published tables of the recognition experiment, and how a simulated one compares.
//
// A table is CSV in UTF-8 with a header: the columns milk_ml_m3, distance_mm and fitness_mean are
// needed, others are left alone.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/studies/recognition/recognition.h"

namespace turbidock::recognition {

// Distances of a cell.
inline constexpr double kNearest_mm = 200, kFarthest_mm = 10000;

struct TableRow {
  RecognitionCell cell;
  double fitness_mean = 0;

  TURBIDOCK_FIELDS(cell, fitness_mean)
};

// ConfigError "FILE:LINE: COLUMN = '...', must be ..." for whatever is wrong: no file, no text, a
// missing column, what is no number, a value out of its range, a cell that occurs twice.
std::vector<TableRow> ReadRecognitionTable(const std::string& path, MarkerKind marker);

// The bundled table of that marker: the published columns.
std::vector<TableRow> PublishedTable(MarkerKind marker);
// Tables of both markers: of these files, or the published ones where they are empty.
std::vector<TableRow> ReadTables(const std::string& active, const std::string& passive);

using Curve = std::map<double, double>;  // mean F over milk

// One marker in one cell of a plan, by milk.
struct Column {
  std::string name;                         // the cell's, or else the distance
  double distance_m = 0;                    // of its first trial
  std::map<double, CellResult> cells = {};  // trials of the same milk are one
  Curve simulated = {}, reference = {};
};
using Columns = std::vector<Column>;  // in the results' order

// The results and, of their markers and distances, the rows of tables.
std::map<MarkerKind, Columns> ColumnsOf(const std::vector<CellResult>& results,
                                        const std::vector<TableRow>& tables);

// Milk at which F falls to the limit of recognition, 0.22: where the mean of three neighbours (two
// at the ends), joined by straight lines, first comes down to it. Nothing where it never does, or
// is below from the beginning.
std::optional<double> MilkAtLoss(const Curve& fitness_over_milk);

// How a run compares with a table, cell by cell.
struct TableComparison {
  double rmse = 0;            // of mean F
  double area_agreement = 0;  // share of cells in the same Area
  struct Loss {
    std::optional<double> simulated_ml_m3, reference_ml_m3;
    std::optional<double> ratio() const;
  };
  std::map<double, Loss> loss_by_distance_m = {};
  // Simulated minus published mean F where the published marker is lost for certain: at more than
  // 1.2 times its turbidity limit. Nothing where there is no such cell.
  std::optional<double> lost_fitness_error = {};
  // Mean deviation of F in cells whose published marker is not lost.
  std::optional<double> fitness_std = {};
};

// Of one marker, where table and results have the same cells; nothing where there is none.
std::optional<TableComparison> Compare(const std::vector<CellResult>& results,
                                       const std::vector<TableRow>& table);

}  // namespace turbidock::recognition
