#include "experiments/farm/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "experiments/trial/record_columns.h"
#include "sim/base/units.h"

namespace turbidock::farm {
namespace {

Spread SpreadOf(const std::vector<double>& values) {
  return {statistics::Quantile(values, 0.1), statistics::Quantile(values, 0.5),
          statistics::Quantile(values, 0.9), std::ssize(values)};
}

// Numbers in their order, before and apart from words in theirs.
struct ByValue {
  static std::pair<bool, double> Number(const std::string& text) {
    double number = 0;
    const char* const end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, number);
    return {result.ec != std::errc{} || result.ptr != end, number};
  }
  bool operator()(const std::string& a, const std::string& b) const {
    return std::pair(Number(a), a) < std::pair(Number(b), b);
  }
  bool operator()(const std::vector<std::string>& a, const std::vector<std::string>& b) const {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), *this);
  }
};

std::string Cell(const Spread& spread, double scale) {
  if (spread.count == 0) return "-";
  return fmt::format("{:.0f} [{:.0f}, {:.0f}]", scale * *spread.median, scale * *spread.low,
                     scale * *spread.high);
}

std::string Percent(const statistics::Interval& interval) {
  return fmt::format("{:.0f}-{:.0f}", 100 * interval.low, 100 * interval.high);
}

std::string FailureList(const std::map<trial::Failure, int64_t>& failures) {
  std::vector<std::pair<int64_t, std::string>> sorted;
  for (const auto& [failure, count] : failures) sorted.emplace_back(-count, NameOf(failure));
  std::sort(sorted.begin(), sorted.end());
  std::string list;
  for (const auto& [count, name] : sorted)
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", -count, name);
  return list;
}

// Rows of equally wide columns; the first `left` ones begin, the others end in line.
std::string Aligned(const std::vector<std::vector<std::string>>& rows, size_t left) {
  std::vector<size_t> widths(rows[0].size());
  for (const auto& row : rows)
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) {
      const bool begins = i < left || i + 1 == row.size();
      line += (i == 0 ? "" : "  ") + (begins ? fmt::format("{:<{}}", row[i], widths[i])
                                             : fmt::format("{:>{}}", row[i], widths[i]));
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace

GroupKey::GroupKey(const std::string& name, const StoredTrial& example) {
  for (size_t i = 0; i < example.parameters.size(); ++i)
    if (example.parameters[i].key == name) {
      value_ = [i](const StoredTrial& trial) { return trial.parameters[i].value; };
      return;
    }
  using Known = std::pair<std::string, std::function<std::string(const StoredTrial&)>>;
  std::vector<Known> known = {
      {"outcome", [](const StoredTrial& trial) { return NameOf(trial.record.outcome); }},
      {"failure", [](const StoredTrial& trial) { return NameOf(trial.record.failure); }},
      {"cell", [](const StoredTrial& trial) { return std::to_string(trial.cell); }}};
  for (const trial::Figure& figure : trial::Figures())
    known.emplace_back(figure.name, [&figure](const StoredTrial& trial) {
      const std::optional<double> value = figure.of(trial.record);
      return value ? FormatNumber(*value) : "none";
    });
  for (Known& candidate : known)
    if (candidate.first == name) value_ = std::move(candidate.second);
  if (value_) return;
  std::string names = "outcome, failure, cell";
  for (const Parameter& parameter : example.parameters) names += ", " + parameter.key;
  throw ConfigError(name + ": trials cannot be grouped by this; by " + names + " or a metric");
}

std::vector<GroupSummary> Summarise(const std::vector<StoredTrial>& trials,
                                    const std::vector<std::string>& keys) {
  std::map<std::vector<std::string>, std::vector<const StoredTrial*>, ByValue> groups;
  std::vector<GroupKey> group_keys;
  if (!trials.empty())
    for (const std::string& key : keys) group_keys.emplace_back(key, trials.front());
  for (const StoredTrial& trial : trials) {
    std::vector<std::string> values;
    for (const GroupKey& key : group_keys) values.push_back(key.ValueOf(trial));
    groups[values].push_back(&trial);
  }
  std::vector<GroupSummary> summaries;
  for (const auto& [values, members] : groups) {
    GroupSummary summary;
    summary.values = values;
    std::vector<double> times_s, errors_y_m, errors_z_m;
    for (const StoredTrial* trial : members) {
      const trial::TrialRecord& r = trial->record;
      ++summary.trials;
      if (r.success()) {
        ++summary.successes;
        times_s.push_back(r.time_s);
      } else {
        ++summary.failures[r.failure];
      }
      if (!r.docked) continue;
      errors_y_m.push_back(std::abs(r.final_error_true.y_m));
      errors_z_m.push_back(std::abs(r.final_error_true.z_m));
    }
    summary.wilson = statistics::WilsonInterval(summary.successes, summary.trials);
    summary.clopper_pearson = statistics::ClopperPearsonInterval(summary.successes, summary.trials);
    summary.time_to_dock_s = SpreadOf(times_s);
    summary.error_y_m = SpreadOf(errors_y_m);
    summary.error_z_m = SpreadOf(errors_z_m);
    summaries.push_back(std::move(summary));
  }
  return summaries;
}

std::string SummaryTable(const std::vector<std::string>& keys,
                         const std::vector<GroupSummary>& groups) {
  std::vector<std::vector<std::string>> rows(1, keys);
  for (const char* title :
       {"trials", "success %", "Wilson", "exact", "time to dock s", "|y| mm", "|z| mm", "failures"})
    rows[0].emplace_back(title);
  for (const GroupSummary& group : groups) {
    std::vector<std::string> row = group.values;
    row.push_back(std::to_string(group.trials));
    row.push_back(fmt::format("{:.1f}", 100.0 * static_cast<double>(group.successes) /
                                            static_cast<double>(group.trials)));
    row.push_back(Percent(group.wilson));
    row.push_back(Percent(group.clopper_pearson));
    row.push_back(Cell(group.time_to_dock_s, 1));
    row.push_back(Cell(group.error_y_m, units::MmFromM(1)));
    row.push_back(Cell(group.error_z_m, units::MmFromM(1)));
    row.push_back(FailureList(group.failures));
    rows.push_back(std::move(row));
  }
  return Aligned(rows, keys.size()) +
         "Wilson, exact (Clopper-Pearson): 95 % intervals of the success rate in %. "
         "Others: median [10 %, 90 %].\n";
}

std::string SummaryJson(const std::vector<std::string>& keys,
                        const std::vector<GroupSummary>& groups) {
  using Json = nlohmann::ordered_json;
  const auto spread = [](const Spread& s) {
    const auto number = [](const std::optional<double>& x) { return x ? Json(*x) : Json(); };
    return Json{{"count", s.count},
                {"q10", number(s.low)},
                {"median", number(s.median)},
                {"q90", number(s.high)}};
  };
  Json list = Json::array();
  for (const GroupSummary& group : groups) {
    std::map<std::string, int64_t> failures;
    for (const auto& [failure, count] : group.failures) failures[NameOf(failure)] = count;
    Json values = Json::object();
    for (size_t i = 0; i < keys.size(); ++i) values[keys[i]] = group.values[i];
    list.push_back({{"group", values},
                    {"trials", group.trials},
                    {"successes", group.successes},
                    {"wilson", {group.wilson.low, group.wilson.high}},
                    {"clopper_pearson", {group.clopper_pearson.low, group.clopper_pearson.high}},
                    {"time_to_dock_s", spread(group.time_to_dock_s)},
                    {"error_true_y_m", spread(group.error_y_m)},
                    {"error_true_z_m", spread(group.error_z_m)},
                    {"failures", failures}});
  }
  return list.dump(2) + "\n";
}

}  // namespace turbidock::farm
