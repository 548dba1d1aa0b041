#include "experiments/studies/recognition/table.h"

#include <fmt/format.h>

#include <algorithm>
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

struct Column {
  const char* name;
  Range range;
};
const Column kMilk = {"milk_ml_m3", InRange(0, light::kMaxMilk_ml_m3)},
             kDistance = {"distance_mm", InRange(kNearest_mm, kFarthest_mm)},
             kMean = {"fitness_mean", InRange(-1, 1)}, kStd = {"fitness_std", InRange(0, 1)};

std::vector<std::string> SplitLine(const std::string& line) {
  std::vector<std::string> fields;
  boost::split(fields, line, boost::is_any_of(","));
  for (std::string& field : fields) boost::trim(field);
  return fields;
}

void CheckHeader(const std::string& where, const std::vector<std::string>& header) {
  for (const Column& column : {kMilk, kDistance, kMean, kStd}) {
    const auto count = std::ranges::count(header, column.name);
    if (count > 1) throw ConfigError(where + column.name + ": this column occurs twice");
    if (count == 1 || column.name == kStd.name) continue;
    const std::string nearest = config::NearestName(column.name, header);
    throw ConfigError(where + column.name + ": this column is missing" +
                      (nearest.empty() ? "" : "; is it " + nearest + "?"));
  }
}

double ReadNumber(const std::string& where, const Column& column, const std::string& text) {
  const std::optional<double> value = report::NumberIn(text);
  if (!value)
    throw ConfigError(
        fmt::format("{}{} = '{}', must be a number", where, column.name, system::Shortened(text)));
  if (!column.range.Contains(*value))
    throw ConfigError(fmt::format("{}{} = {}, {}", where, column.name, system::Shortened(text),
                                  column.range.Sentence()));
  return *value;
}

// Over the turbidity limit; nearer to it F comes and goes.
constexpr double kSurelyLost = 1.2;
// A little milk, at which the published F is best.
constexpr double kLittleMilk_ml_m3[] = {2, 20};

// From simulated and published F by milk.
void SetBest(const std::map<double, std::pair<double, double>>& curve,
             TableComparison* comparison) {
  const auto is_worse = [](const auto& a, const auto& b) {
    return a.second.first < b.second.first;
  };
  comparison->best_milk_ml_m3 = std::max_element(curve.begin(), curve.end(), is_worse)->first;
  const auto little = curve.lower_bound(kLittleMilk_ml_m3[0]),
             more = curve.upper_bound(kLittleMilk_ml_m3[1]);
  if (little != more && curve.begin()->first == 0)
    comparison->rise =
        std::max_element(little, more, is_worse)->second.first - curve.begin()->second.first;
}

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
  CheckHeader(path + ":1: ", header);

  std::vector<TableRow> rows;
  std::set<RecognitionCell> known;
  for (int number = 2; std::getline(file, line); ++number) {
    const std::vector<std::string> fields = SplitLine(line);
    if (fields.size() == 1 && fields[0].empty()) continue;
    const std::string where = fmt::format("{}:{}: ", path, number);
    if (fields.size() != header.size())
      throw ConfigError(
          fmt::format("{}{} columns, the header has {}", where, fields.size(), header.size()));
    const auto read = [&](const Column& column) -> std::optional<double> {
      const auto place = std::ranges::find(header, column.name) - header.begin();
      if (place == std::ssize(header)) return std::nullopt;
      return ReadNumber(where, column, fields[static_cast<size_t>(place)]);
    };
    const TableRow row{
        {marker, *read(kMilk), units::MFromMm(*read(kDistance))}, *read(kMean), read(kStd)};
    if (!known.insert(row.cell).second)
      throw ConfigError(fmt::format("{}{} ml/m3 at {} mm occurs twice", where, row.cell.milk_ml_m3,
                                    units::MmFromM(row.cell.distance_m)));
    rows.push_back(row);
  }
  if (rows.empty()) throw ConfigError(path + ": has a header but no rows");
  return rows;
}

std::vector<TableRow> PublishedTable(MarkerKind marker) {
  return ReadRecognitionTable(config::AssetPath(fmt::format("recognition_{}.csv", NameOf(marker))),
                              marker);
}

std::vector<RecognitionCell> CellsOf(const std::vector<TableRow>& rows) {
  std::vector<RecognitionCell> cells;
  cells.reserve(rows.size());
  for (const TableRow& row : rows) cells.push_back(row.cell);
  return cells;
}

std::optional<double> MilkAtLoss(const std::vector<std::pair<double, double>>& fitness_over_milk) {
  const auto smooth = [&](size_t i) {
    const size_t first = i == 0 ? 0 : i - 1;
    const size_t last = std::min(i + 1, fitness_over_milk.size() - 1);
    double sum = 0;
    for (size_t j = first; j <= last; ++j) sum += fitness_over_milk[j].second;
    return sum / static_cast<double>(last - first + 1);
  };
  constexpr double kLimit = trial::ViewCriteria{}.detection_fitness;
  for (size_t i = 1; i < fitness_over_milk.size(); ++i) {
    const double before = smooth(i - 1), after = smooth(i);
    if (before <= kLimit || after > kLimit) continue;
    const double share = (before - kLimit) / (before - after);
    const double from = fitness_over_milk[i - 1].first, to = fitness_over_milk[i].first;
    return from + share * (to - from);
  }
  return std::nullopt;
}

std::optional<double> TableComparison::Loss::ratio() const {
  if (!simulated_ml_m3 || !reference_ml_m3) return std::nullopt;
  return *simulated_ml_m3 / *reference_ml_m3;
}

TableComparison Compare(const std::vector<CellResult>& results,
                        const std::vector<TableRow>& table) {
  TD_CHECK(results.size() == table.size() && !table.empty(), "results of another table");
  TableComparison comparison;
  std::map<double, std::map<double, std::pair<double, double>>> curves;  // by distance and milk
  for (size_t i = 0; i < table.size(); ++i) {
    const double simulated = results[i].fitness_mean, reference = table[i].fitness_mean;
    comparison.rmse += (simulated - reference) * (simulated - reference);
    comparison.area_agreement += AreaOf(simulated) == AreaOf(reference);
    curves[table[i].cell.distance_m][table[i].cell.milk_ml_m3] = {simulated, reference};
  }
  const auto cells = static_cast<double>(table.size());
  comparison.rmse = std::sqrt(comparison.rmse / cells);
  comparison.area_agreement /= cells;
  for (const auto& [distance_m, curve] : curves) {
    std::vector<std::pair<double, double>> simulated, reference;
    for (const auto& [milk, fitness] : curve) {
      simulated.emplace_back(milk, fitness.first);
      reference.emplace_back(milk, fitness.second);
    }
    comparison.loss_by_distance_m[distance_m] = {MilkAtLoss(simulated), MilkAtLoss(reference)};
  }
  std::vector<double> lost_errors, deviations;
  for (size_t i = 0; i < table.size(); ++i) {
    const auto& [cell, reference, reference_std] = table[i];
    const auto& loss = comparison.loss_by_distance_m.at(cell.distance_m).reference_ml_m3;
    if (loss && cell.milk_ml_m3 > kSurelyLost * *loss)
      lost_errors.push_back(results[i].fitness_mean - reference);
    if (AreaOf(reference) != Area::kIII) deviations.push_back(results[i].fitness_std);
  }
  comparison.lost_fitness_error = MeanOf(lost_errors);
  comparison.fitness_std = MeanOf(deviations);
  SetBest(curves.begin()->second, &comparison);
  return comparison;
}

}  // namespace turbidock::recognition
