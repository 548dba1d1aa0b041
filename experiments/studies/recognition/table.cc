#include "experiments/studies/recognition/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/algorithm/string.hpp>
#include <cmath>
#include <numeric>
#include <set>
#include <sstream>

#include "experiments/config/data_files.h"
#include "experiments/config/nearest_name.h"
#include "experiments/config/yaml_node.h"
#include "experiments/report/table.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

const struct {
  const char* name;
  Range range;
} kColumns[] = {{"milk_ml_m3", InRange(0, light::kMaxMilk_ml_m3)},
                {"distance_mm", InRange(kNearest_mm, kFarthest_mm)},
                {"fitness_mean", InRange(-1, 1)}};

std::vector<std::string> SplitLine(const std::string& line) {
  std::vector<std::string> fields;
  boost::split(fields, line, boost::is_any_of(","));
  for (std::string& field : fields) boost::trim(field);
  return fields;
}

// Where a column is in a line.
size_t PlaceOf(const std::string& column, const std::vector<std::string>& header,
               const std::string& where) {
  const auto place = std::ranges::find(header, column);
  if (std::count(place, header.end(), column) > 1)
    throw ConfigError(where + column + ": this column occurs twice");
  if (place != header.end()) return static_cast<size_t>(place - header.begin());
  const std::string nearest = config::NearestName(column, header);
  throw ConfigError(where + column + ": this column is missing" +
                    (nearest.empty() ? "" : "; is it " + nearest + "?"));
}

double ReadNumber(const std::string& text, const char* name, const Range& range,
                  const std::string& where) {
  const std::optional<double> value = report::NumberIn(text);
  if (!value)
    throw ConfigError(
        fmt::format("{}{} = '{}', must be a number", where, name, system::Shortened(text)));
  if (!range.Contains(*value))
    throw ConfigError(
        fmt::format("{}{} = {}, {}", where, name, system::Shortened(text), range.Sentence()));
  return *value;
}

// Of several trials one, with all of their frames.
void Join(const CellResult& more, CellResult* all) {
  const auto before = static_cast<double>(all->fitness.size()),
             added = static_cast<double>(more.fitness.size());
  for (const auto mean :
       {&CellResult::position_error_mean_m, &CellResult::right, &CellResult::wrong_and_sure})
    all->*mean = (before * all->*mean + added * more.*mean) / (before + added);
  std::vector<float> fitness = all->fitness;
  fitness.insert(fitness.end(), more.fitness.begin(), more.fitness.end());
  SetFitness(std::move(fitness), all);
}

// Over the turbidity limit; nearer to it F comes and goes.
constexpr double kSurelyLost = 1.2;

std::optional<double> MeanOf(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

std::vector<TableRow> ReadRecognitionTable(const std::string& path, MarkerKind marker) {
  std::string text = system::ReadWhole(path);
  config::RequireText(text, {nullptr, path, ""});
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // as spreadsheets write it
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  std::istringstream file(text);
  std::string line;
  if (!std::getline(file, line)) throw ConfigError(path + ": is empty");
  const std::vector<std::string> header = SplitLine(line);
  std::array<size_t, std::size(kColumns)> places{};
  for (size_t i = 0; i < places.size(); ++i)
    places[i] = PlaceOf(kColumns[i].name, header, path + ":1: ");

  std::vector<TableRow> rows;
  std::set<RecognitionCell> known;
  for (int number = 2; std::getline(file, line); ++number) {
    const std::vector<std::string> fields = SplitLine(line);
    if (fields.size() == 1 && fields[0].empty()) continue;
    const std::string where = fmt::format("{}:{}: ", path, number);
    if (fields.size() != header.size())
      throw ConfigError(
          fmt::format("{}{} columns, the header has {}", where, fields.size(), header.size()));
    std::array<double, std::size(kColumns)> values{};
    for (size_t i = 0; i < places.size(); ++i)
      values[i] = ReadNumber(fields[places[i]], kColumns[i].name, kColumns[i].range, where);
    const auto [milk_ml_m3, distance_mm, fitness_mean] = values;
    rows.push_back({{marker, milk_ml_m3, units::MFromMm(distance_mm)}, fitness_mean});
    if (!known.insert(rows.back().cell).second)
      throw ConfigError(
          fmt::format("{}{} ml/m3 at {} mm occurs twice", where, milk_ml_m3, distance_mm));
  }
  if (rows.empty()) throw ConfigError(path + ": has a header but no rows");
  return rows;
}

std::vector<TableRow> PublishedTable(MarkerKind marker) {
  return ReadRecognitionTable(config::AssetPath(fmt::format("recognition_{}.csv", NameOf(marker))),
                              marker);
}

std::vector<TableRow> ReadTables(const std::string& active, const std::string& passive) {
  std::vector<TableRow> rows;
  for (const auto& [marker, path] :
       {std::pair(MarkerKind::kActive, active), std::pair(MarkerKind::kPassive, passive)})
    for (const TableRow& row :
         path.empty() ? PublishedTable(marker) : ReadRecognitionTable(path, marker))
      rows.push_back(row);
  return rows;
}

std::map<MarkerKind, Columns> ColumnsOf(const std::vector<CellResult>& results,
                                        const std::vector<TableRow>& tables) {
  std::map<MarkerKind, Columns> columns;
  for (const CellResult& r : results) {
    Columns& of_marker = columns[r.cell.marker];
    const std::string name =
        r.name.empty() ? fmt::format("{:g} mm", units::MmFromM(r.cell.distance_m)) : r.name;
    auto column = std::ranges::find(of_marker, name, &Column::name);
    if (column == of_marker.end())
      column = of_marker.insert(column, {.name = name, .distance_m = r.cell.distance_m});
    const auto [cell, is_new] = column->cells.try_emplace(r.cell.milk_ml_m3, r);
    if (!is_new) Join(r, &cell->second);
    column->simulated[r.cell.milk_ml_m3] = cell->second.fitness_mean;
  }
  for (auto& [marker, of_marker] : columns)
    for (Column& column : of_marker)
      for (const auto& [cell, fitness_mean] : tables)
        if (cell.marker == marker && cell.distance_m == column.distance_m)
          column.reference[cell.milk_ml_m3] = fitness_mean;
  return columns;
}

std::optional<double> MilkAtLoss(const Curve& fitness_over_milk) {
  const std::vector<std::pair<double, double>> points(fitness_over_milk.begin(),
                                                      fitness_over_milk.end());
  const auto smooth = [&](size_t i) {
    const size_t first = i == 0 ? 0 : i - 1, last = std::min(i + 1, points.size() - 1);
    double sum = 0;
    for (size_t j = first; j <= last; ++j) sum += points[j].second;
    return sum / static_cast<double>(last - first + 1);
  };
  constexpr double kLimit = trial::ViewCriteria{}.detection_fitness;
  for (size_t i = 1; i < points.size(); ++i) {
    const double before = smooth(i - 1), after = smooth(i);
    if (before > kLimit && after <= kLimit)
      return std::lerp(points[i - 1].first, points[i].first, (before - kLimit) / (before - after));
  }
  return std::nullopt;
}

std::optional<double> TableComparison::Loss::ratio() const {
  if (!simulated_ml_m3 || !reference_ml_m3) return std::nullopt;
  return *simulated_ml_m3 / *reference_ml_m3;
}

std::optional<TableComparison> Compare(const std::vector<CellResult>& results,
                                       const std::vector<TableRow>& table) {
  TableComparison comparison;
  const std::map<MarkerKind, Columns> columns = ColumnsOf(results, table);
  for (const auto& [marker, of_marker] : columns)
    for (const Column& column : of_marker)
      if (!column.reference.empty())
        comparison.loss_by_distance_m[column.distance_m] = {MilkAtLoss(column.simulated),
                                                            MilkAtLoss(column.reference)};
  std::map<RecognitionCell, double> references;
  for (const auto& [cell, fitness_mean] : table) references[cell] = fitness_mean;
  std::vector<double> squares, agreements, lost_errors, deviations;
  for (const CellResult& r : results) {
    const auto row = references.find(r.cell);
    if (row == references.end()) continue;
    const double reference = row->second, error = r.fitness_mean - reference;
    squares.push_back(error * error);
    agreements.push_back(AreaOf(r.fitness_mean) == AreaOf(reference));
    const auto& loss = comparison.loss_by_distance_m[r.cell.distance_m].reference_ml_m3;
    if (loss && r.cell.milk_ml_m3 > kSurelyLost * *loss) lost_errors.push_back(error);
    if (AreaOf(reference) != Area::kIII) deviations.push_back(r.fitness_std);
  }
  if (squares.empty()) return std::nullopt;
  comparison.rmse = std::sqrt(*MeanOf(squares));
  comparison.area_agreement = *MeanOf(agreements);
  comparison.lost_fitness_error = MeanOf(lost_errors);
  comparison.fitness_std = MeanOf(deviations);
  return comparison;
}

}  // namespace turbidock::recognition
