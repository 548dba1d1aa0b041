#include "experiments/studies/recognition/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <set>

#include "experiments/config/data_files.h"
#include "experiments/config/nearest_name.h"
#include "experiments/report/table.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

struct Column {
  const char* name;
  bool needed;
  Range range;
};
enum { kMilk, kDistance, kMean, kStd };
const std::array<Column, 4> kColumns = {{{"milk_ml_m3", true, InRange(0, light::kMaxMilk_ml_m3)},
                                         {"distance_mm", true, InRange(200, 10000)},
                                         {"fitness_mean", true, InRange(-1, 1)},
                                         {"fitness_std", false, InRange(0, 1)}}};

std::vector<std::string> SplitLine(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',')
      fields.emplace_back();
    else if (c != '\r')
      fields.back() += c;
  }
  for (std::string& field : fields) {
    const size_t first = field.find_first_not_of(" \t"), last = field.find_last_not_of(" \t");
    field = first == std::string::npos ? "" : field.substr(first, last - first + 1);
  }
  return fields;
}

// Place of each column in the header; nothing where it is absent.
std::array<std::optional<size_t>, 4> FindColumns(const std::string& where,
                                                 const std::vector<std::string>& header) {
  std::array<std::optional<size_t>, 4> places;
  for (size_t c = 0; c < kColumns.size(); ++c) {
    const auto found = std::find(header.begin(), header.end(), kColumns[c].name);
    if (found != header.end()) {
      places[c] = static_cast<size_t>(found - header.begin());
      if (std::find(found + 1, header.end(), kColumns[c].name) != header.end())
        throw ConfigError(where + kColumns[c].name + ": this column occurs twice");
    } else if (kColumns[c].needed) {
      const std::string nearest = config::NearestName(kColumns[c].name, header);
      throw ConfigError(where + kColumns[c].name + ": this column is missing" +
                        (nearest.empty() ? "" : "; is it " + nearest + "?"));
    }
  }
  return places;
}

double ReadNumber(const std::string& where, const Column& column, const std::string& text) {
  const std::optional<double> value = report::NumberIn(text);
  if (!value)
    throw ConfigError(fmt::format("{}{} = '{}', must be a number", where, column.name, text));
  if (!column.range.Contains(*value))
    throw ConfigError(
        fmt::format("{}{} = {}, {}", where, column.name, text, column.range.Sentence()));
  return *value;
}

}  // namespace

std::vector<TableRow> ReadRecognitionTable(const std::string& path, MarkerKind marker) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) throw ConfigError(path + ": cannot be read, or holds nothing");
  const std::vector<std::string> header = SplitLine(line);
  const auto places = FindColumns(path + ":1: ", header);

  std::vector<TableRow> rows;
  std::set<RecognitionCell> known;
  for (int number = 2; std::getline(file, line); ++number) {
    const std::vector<std::string> fields = SplitLine(line);
    if (fields.size() == 1 && fields[0].empty()) continue;
    const std::string where = fmt::format("{}:{}: ", path, number);
    if (fields.size() != header.size())
      throw ConfigError(
          fmt::format("{}{} columns, the header has {}", where, fields.size(), header.size()));
    const auto read = [&](int c) {
      const auto i = static_cast<size_t>(c);
      return ReadNumber(where, kColumns[i], fields[*places[i]]);
    };
    TableRow row{.cell = {marker, read(kMilk), units::MFromMm(read(kDistance))},
                 .fitness_mean = read(kMean),
                 .fitness_std = {}};
    if (places[kStd]) row.fitness_std = read(kStd);
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
  return comparison;
}

}  // namespace turbidock::recognition
