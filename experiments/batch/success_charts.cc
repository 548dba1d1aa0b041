#include "experiments/batch/success_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "experiments/batch/batch_report.h"
#include "experiments/batch/summary.h"
#include "experiments/report/table.h"
#include "experiments/statistics/intervals.h"
#include "experiments/trial/record_columns.h"

namespace turbidock::batch {
namespace {

// Numbers of more values are put into so many bins.
struct Fineness {
  size_t most_values;
  double bins;
};
constexpr Fineness kAcross{40, 12}, kLines{8, 5};

// What trials have of one quantity, as a person reads it.
struct Values {
  report::Quantity name;
  std::vector<std::string> texts;              // empty: none
  std::vector<std::optional<double>> numbers;  // of all that have one, or of none
  std::set<std::string> distinct = {};
};

// The least of 1, 2, 2.5, 5 and 10 times a power of ten that is no less.
double RoundStep(double least) {
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 2.5, 5.0})
    if (factor * power >= 0.999 * least) return factor * power;
  return 10 * power;
}

Groups BinsOf(const Values& values, const Fineness& fineness) {
  double low = INFINITY, high = -INFINITY, count = 0;
  for (const auto& number : values.numbers) {
    if (!number) continue;
    low = std::min(low, *number);
    high = std::max(high, *number);
    ++count;
  }
  const double bins = std::clamp(std::ceil(std::sqrt(count)), 4.0, fineness.bins);
  const double width = RoundStep((high - low) / bins), first = std::floor(low / width);
  Groups groups;
  const auto count_of_bins = std::lround(std::floor(high / width) - first) + 1;
  for (int k = 0; k < count_of_bins; ++k) {
    const double from = (first + k) * width;
    groups.names.push_back(report::Digits(from, 3) + " to " + report::Digits(from + width, 3));
    groups.at.push_back(from + width / 2);
  }
  for (const auto& number : values.numbers)
    groups.of.push_back(number ? static_cast<int>(std::floor(*number / width) - first) : -1);
  return groups;
}

Groups GroupsOf(const Values& values, bool is_number, const Fineness& fineness) {
  if (is_number && values.distinct.size() > fineness.most_values) return BinsOf(values, fineness);
  std::vector<std::string> sorted(values.distinct.begin(), values.distinct.end());
  std::ranges::stable_sort(
      sorted, [](const std::string& a, const std::string& b) { return LessByValue({a}, {b}); });
  Groups groups;
  std::map<std::string, int> places;
  for (const std::string& text : sorted) {
    const auto place = static_cast<int>(places.size());
    groups.names.push_back(is_number ? report::Digits(*report::NumberIn(text)) : text);
    groups.at.push_back(is_number ? *report::NumberIn(text) : place);
    places[text] = place;
  }
  for (const std::string& text : values.texts)
    groups.of.push_back(text.empty() ? -1 : places.at(text));
  return groups;
}

// Nothing for what is the same in all of them.
std::optional<TrialAxis> AxisOf(const std::string& key, Values values) {
  bool is_number = true;
  for (const std::string& text : values.texts) {
    if (text.empty()) continue;
    values.distinct.insert(text);
    is_number &= report::NumberIn(text).has_value();
  }
  if (values.distinct.size() < 2) return std::nullopt;
  for (const std::string& text : values.texts)
    values.numbers.push_back(is_number ? report::NumberIn(text) : std::nullopt);
  return TrialAxis{.key = key,
                   .label = values.name.Title(),
                   .is_number = is_number,
                   .across = GroupsOf(values, is_number, kAcross),
                   .lines = GroupsOf(values, is_number, kLines)};
}

std::string TextOf(const trial::Cell& cell, double factor) {
  if (cell.is_string()) return cell.get<std::string>();
  return cell.is_null() ? "" : fmt::format("{}", factor * cell.get<double>());
}

std::vector<TrialAxis> AxesOf(const StoreHeader& header, const std::vector<StoredTrial>& trials) {
  std::vector<TrialAxis> axes;
  const auto add = [&](const std::string& key, const report::Quantity& name, const auto& cell_of) {
    Values values{.name = name, .texts = {}, .numbers = {}};
    for (const StoredTrial& trial : trials)
      values.texts.push_back(TextOf(cell_of(trial), name.factor));
    if (auto axis = AxisOf(key, std::move(values))) axes.push_back(*std::move(axis));
  };
  for (size_t k = 0; k < header.keys.size(); ++k)
    add(header.keys[k], NameOfKey(header.keys[k]),
        [k](const StoredTrial& trial) { return ValueOf(trial.parameters[k]); });
  for (const trial::Metric& metric : trial::Metrics())
    if (metric.name.starts_with("start_"))
      add(metric.name, NameOfKey(metric.name), [&](const StoredTrial& trial) {
        const auto value = metric.of(trial.record);
        return value ? trial::CellOf(*value) : trial::Cell();
      });
  return axes;
}

// Each trial's stratum where an interval may be narrower by what the strata tell; else 0.
using Strata = std::vector<size_t>;

// A bar for each group along the axis that has trials of this line.
report::Series LineOf(const std::vector<StoredTrial>& trials, const TrialAxis& over,
                      const Groups* by, int line, const Strata& strata) {
  std::vector<std::vector<statistics::RatedTrial>> groups(over.across.names.size());
  for (size_t i = 0; i < trials.size(); ++i) {
    const trial::TrialRecord& record = trials[i].record;
    if (!record.judged() || over.across.of[i] < 0 || (by && by->of[i] != line)) continue;
    groups[static_cast<size_t>(over.across.of[i])].push_back(
        {record.success(), strata.empty() ? 0 : strata[i], record.seed});
  }
  const auto lines = static_cast<double>(by ? by->names.size() : 1);
  // side by side, or bars would hide each other
  const double step =
      over.is_number ? 0.006 * (over.across.at.back() - over.across.at.front()) : 0.1;
  const auto number = static_cast<size_t>(line);
  report::Series series{.name = by ? by->names[number] : "success",
                        .color = report::CurveColor(number),
                        .mark = over.is_number ? report::Mark::kLineWithBars : report::Mark::kBars,
                        .dot_px = 7};
  for (size_t k = 0; k < groups.size(); ++k) {
    if (groups[k].empty()) continue;
    const auto successes = std::ranges::count(groups[k], true, &statistics::RatedTrial::success);
    series.points.push_back(
        report::SampleWithin(over.across.at[k] + step * (line - (lines - 1) / 2),
                             static_cast<double>(successes) / static_cast<double>(groups[k].size()),
                             statistics::SuccessInterval(groups[k]), 100));
    series.links.push_back(fmt::format("{},{}", k, line));
  }
  return series;
}

report::Panel ChartOf(const std::vector<StoredTrial>& trials, const TrialAxis& over,
                      const TrialAxis* by, const Strata& strata) {
  report::Panel panel{
      .title = fmt::format("Success over {}{}", over.label, by ? ", by " + by->label : ""),
      .x = {.label = over.label},
      .y = {"success, %", -3, 103},
      .rules = {{50}}};
  if (!over.is_number) panel.x.names = over.across.names;
  for (int line = 0; line < (by ? std::ssize(by->lines.names) : 1); ++line)
    panel.series.push_back(LineOf(trials, over, by ? &by->lines : nullptr, line, strata));
  return panel;
}

}  // namespace

SuccessCharts ChartsOf(const StoreHeader& header, const std::vector<StoredTrial>& trials) {
  SuccessCharts charts{.axes = AxesOf(header, trials)};
  if (charts.axes.empty()) return charts;
  const std::vector<std::string> grid = GridOf(header);
  const auto is_planned = [&](const TrialAxis& axis) {
    return std::ranges::count(grid, axis.key) > 0;
  };
  // those of whole cells: what trials drew tells nothing of their strata
  const auto by_stratum = std::ranges::find(charts.axes, kStratumKey, &TrialAxis::key);
  Strata strata;
  if (by_stratum != charts.axes.end())
    for (const int group : by_stratum->across.of)
      strata.push_back(static_cast<size_t>(std::max(group, 0)));
  const auto is_whole = [&](const TrialAxis& axis) {
    return is_planned(axis) || axis.key == kStratumKey;
  };
  const auto first = std::ranges::find_if(charts.axes, [](const TrialAxis& axis) {
    return axis.is_number && !axis.key.starts_with("start_");
  });
  charts.over = first == charts.axes.end() ? charts.axes[0].key : first->key;
  for (const TrialAxis& axis : charts.axes)
    if (charts.by.empty() && axis.key != charts.over && is_planned(axis) &&
        axis.across.names.size() <= kLines.most_values)
      charts.by = axis.key;
  for (const TrialAxis& over : charts.axes) {
    charts.panels[over.key + "|"] =
        ChartOf(trials, over, nullptr, is_whole(over) ? strata : Strata());
    for (const TrialAxis& by : charts.axes)
      if (by.key != over.key)
        charts.panels[over.key + "|" + by.key] =
            ChartOf(trials, over, &by, is_whole(over) && is_whole(by) ? strata : Strata());
  }
  return charts;
}

}  // namespace turbidock::batch
