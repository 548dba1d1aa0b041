#include "experiments/farm/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "experiments/report/json.h"
#include "experiments/report/table.h"
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
  return fmt::format("{:.0f} [{:.0f}, {:.0f}]", scale * *spread.median, scale * *spread.q10,
                     scale * *spread.q90);
}

std::string FailureList(const std::map<std::string, int64_t>& failures) {
  std::vector<std::pair<int64_t, std::string>> sorted;
  sorted.reserve(failures.size());
  for (const auto& [name, count] : failures) sorted.emplace_back(-count, name);
  std::sort(sorted.begin(), sorted.end());
  std::string list;
  for (const auto& [count, name] : sorted)
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", -count, name);
  return list;
}

bool IsReached(const GroupSummary& group, double precision) {
  return group.wilson.half_width() <= precision;
}

}  // namespace

void SuccessCount::Add(const StoredTrial& trial) {
  const auto at = std::ranges::find(trial.parameters, kStratumKey, &Parameter::key);
  const bool has_one = whole_cells_ && at != trial.parameters.end();
  statistics::Count& stratum = strata_[has_one ? at->value : ""];
  ++stratum.trials;
  stratum.successes += trial.record.success();
}

statistics::Count SuccessCount::all() const {
  statistics::Count all;
  for (const auto& [name, stratum] : strata_) {
    all.successes += stratum.successes;
    all.trials += stratum.trials;
  }
  return all;
}

statistics::Interval SuccessCount::Wilson() const {
  std::vector<statistics::Count> strata;
  strata.reserve(strata_.size());
  for (const auto& [name, stratum] : strata_) strata.push_back(stratum);
  return statistics::StratifiedInterval(strata);
}

std::string PercentText(const statistics::Interval& interval) {
  return fmt::format("{:.0f}-{:.0f}", 100 * interval.low, 100 * interval.high);
}

GroupKey::GroupKey(const std::string& name, const StoredTrial& example) {
  // The grid's keys stand before `stratum`, those that are drawn behind it.
  const auto stratum = std::ranges::find(example.parameters, kStratumKey, &Parameter::key);
  is_planned_ = name == "cell";
  for (size_t i = 0; i < example.parameters.size(); ++i)
    if (example.parameters[i].key == name) {
      is_planned_ = static_cast<std::ptrdiff_t>(i) <= stratum - example.parameters.begin();
      value_ = [i](const StoredTrial& trial) { return trial.parameters[i].value; };
      return;
    }
  using Known = std::pair<std::string, std::function<std::string(const StoredTrial&)>>;
  std::vector<Known> known = {
      {"outcome", [](const StoredTrial& trial) { return NameOf(trial.record.outcome); }},
      {"failure", [](const StoredTrial& trial) { return NameOf(trial.record.failure); }},
      {"cell", [](const StoredTrial& trial) { return std::to_string(trial.cell); }}};
  for (const trial::Metric& metric : trial::Metrics())
    known.emplace_back(metric.name, [&metric](const StoredTrial& trial) {
      const std::optional<double> value = metric.of(trial.record);
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
    values.reserve(group_keys.size());
    for (const GroupKey& key : group_keys) values.push_back(key.ValueOf(trial));
    groups[values].push_back(&trial);
  }
  std::vector<GroupSummary> summaries;
  for (const auto& [values, members] : groups) {
    GroupSummary summary;
    summary.group = values;
    SuccessCount count(std::ranges::all_of(group_keys, &GroupKey::is_planned));
    std::vector<double> times_s, errors_y_m, errors_z_m;
    for (const StoredTrial* trial : members) {
      const trial::TrialRecord& r = trial->record;
      count.Add(*trial);
      if (r.success()) {
        times_s.push_back(r.time_s);
      } else {
        ++summary.failures[NameOf(r.failure)];
      }
      if (!r.docked) continue;
      errors_y_m.push_back(std::abs(r.final_error_true.y_m));
      errors_z_m.push_back(std::abs(r.final_error_true.z_m));
    }
    summary.successes = count.all().successes;
    summary.trials = count.all().trials;
    summary.wilson = count.Wilson();
    summary.clopper_pearson = statistics::ClopperPearsonInterval(summary.successes, summary.trials);
    summary.time_to_dock_s = SpreadOf(times_s);
    summary.error_true_y_m = SpreadOf(errors_y_m);
    summary.error_true_z_m = SpreadOf(errors_z_m);
    summaries.push_back(std::move(summary));
  }
  return summaries;
}

std::string SummaryTable(const std::vector<std::string>& keys,
                         const std::vector<GroupSummary>& groups,
                         const std::optional<double>& precision) {
  std::vector<std::string> heads;
  heads.reserve(keys.size() + 9);  // and those below
  for (const std::string& key : keys) heads.push_back("<" + key);
  for (const char* head : {"trials", "success %", "Wilson", "exact", "time to dock s", "|y| mm",
                           "|z| mm", "<failures"})
    heads.emplace_back(head);
  const auto last = std::ssize(heads) - 1;
  if (precision) heads.insert(heads.begin() + last, "half width %");
  report::Table table(heads);
  for (const GroupSummary& group : groups) {
    std::vector<report::Cell> row(group.group.begin(), group.group.end());
    row.insert(
        row.end(),
        {std::to_string(group.trials),
         report::Fixed(
             100.0 * static_cast<double>(group.successes) / static_cast<double>(group.trials), 1),
         PercentText(group.wilson), PercentText(group.clopper_pearson),
         Cell(group.time_to_dock_s, 1), Cell(group.error_true_y_m, units::MmFromM(1)),
         Cell(group.error_true_z_m, units::MmFromM(1)), FailureList(group.failures)});
    if (precision)
      row.insert(row.begin() + last,
                 fmt::format("{:.1f}{}", 100 * group.wilson.half_width(),
                             IsReached(group, *precision) ? "" : " not reached"));
    table.Row(std::move(row));
  }
  return table.Text() +
         "Wilson (over the plan's strata, if any), exact (Clopper-Pearson, without them): "
         "95 % intervals of the success rate in %. Others: median [10 %, 90 %].\n" +
         (precision ? fmt::format("Half width: of Wilson's interval, to be at most {:g} %.\n",
                                  100 * *precision)
                    : "");
}

std::string SummaryJson(const std::vector<std::string>& keys,
                        const std::vector<GroupSummary>& groups,
                        const std::optional<double>& precision) {
  report::Json list = groups;
  for (size_t g = 0; g < groups.size(); ++g) {
    report::Json& group = list[g];
    if (precision) {
      group["half_width"] = groups[g].wilson.half_width();
      group["precision_reached"] = IsReached(groups[g], *precision);
    }
    const report::Json values = std::exchange(group["group"], report::Json::object());
    for (size_t i = 0; i < keys.size(); ++i) group["group"][keys[i]] = values[i];
  }
  return report::JsonText(list);
}

}  // namespace turbidock::farm
