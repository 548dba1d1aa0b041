#include "experiments/studies/recognition/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
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
    throw ConfigError(
        fmt::format("{}{} = '{}', must be a number", where, column.name, system::Shortened(text)));
  if (!column.range.Contains(*value))
    throw ConfigError(fmt::format("{}{} = {}, {}", where, column.name, system::Shortened(text),
                                  column.range.Sentence()));
  return *value;
}

// Over the milk of loss; nearer to it F comes and goes.
constexpr double kSurelyLost = 1.2;
// A little milk, at which the published F is best.
constexpr double kLittleMilk_ml_m3[] = {2, 20};

// Mean of what there is; nothing where there is none.
template <typename ValueOf>
std::optional<double> MeanOver(const std::vector<TableRow>& table, ValueOf&& value_of) {
  double sum = 0;
  int count = 0;
  for (size_t i = 0; i < table.size(); ++i)
    if (const std::optional<double> value = value_of(i)) sum += *value, ++count;
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

// From simulated and published F by milk.
void SetBest(const std::map<double, std::pair<double, double>>& curve,
             TableComparison* comparison) {
  std::optional<double> best, best_little;
  for (const auto& [milk, fitness] : curve) {
    if (!best || fitness.first > *best) {
      best = fitness.first;
      comparison->best_milk_ml_m3 = milk;
    }
    if (milk >= kLittleMilk_ml_m3[0] && milk <= kLittleMilk_ml_m3[1])
      best_little = std::max(best_little.value_or(-1), fitness.first);
  }
  if (best_little && curve.begin()->first == 0)
    comparison->rise = *best_little - curve.begin()->second.first;
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
  comparison.lost_fitness_error = MeanOver(table, [&](size_t i) -> std::optional<double> {
    const auto& loss = comparison.loss_by_distance_m.at(table[i].cell.distance_m);
    if (!loss.reference_ml_m3 || table[i].cell.milk_ml_m3 <= kSurelyLost * *loss.reference_ml_m3)
      return std::nullopt;
    return results[i].fitness_mean - table[i].fitness_mean;
  });
  comparison.fitness_std = MeanOver(table, [&](size_t i) -> std::optional<double> {
    if (AreaOf(table[i].fitness_mean) == Area::kIII) return std::nullopt;
    return results[i].fitness_std;
  });
  SetBest(curves.begin()->second, &comparison);
  return comparison;
}

}  // namespace turbidock::recognition
