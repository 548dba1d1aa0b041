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

// The bundled table of that marker: the published columns 400 and 1000 mm.
std::vector<TableRow> PublishedTable(MarkerKind marker);

using Curve = std::map<double, double>;  // mean F over milk

// One marker at one distance, by milk.
struct Column {
  std::map<double, const CellResult*> cells = {};
  Curve simulated = {}, reference = {};
};
using Columns = std::map<double, Column>;  // by distance

// The results and, of their markers and distances, the rows of a table.
std::map<MarkerKind, Columns> ColumnsOf(const std::vector<CellResult>& results,
                                        const std::vector<TableRow>& table);

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

// Of one marker. `results[i]` belongs to `table[i]`.
TableComparison Compare(const std::vector<CellResult>& results, const std::vector<TableRow>& table);

}  // namespace turbidock::recognition
