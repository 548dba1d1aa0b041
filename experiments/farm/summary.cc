#include "experiments/farm/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/trial/record_columns.h"
#include "sim/base/units.h"

namespace turbidock::farm {
namespace {

Spread SpreadOf(const std::vector<double>& values) {
  return {statistics::Quantile(values, 0.1), statistics::Quantile(values, 0.5),
          statistics::Quantile(values, 0.9), std::ssize(values)};
}

std::pair<bool, double> NumberFirst(const std::string& text) {
  const double number = report::NumberIn(text).value_or(std::nan(""));
  return {!std::isfinite(number), std::isfinite(number) ? number : 0};
}

std::string PercentText(const statistics::Interval& interval) {
  return fmt::format("{:.0f}-{:.0f}", 100 * interval.low, 100 * interval.high);
}

// "12 [3, 45]" in mm or whatever `unit` of them is one.
std::string SpreadText(const Spread& spread, double unit, int digits = 0) {
  if (spread.count == 0) return "-";
  return fmt::format("{:.{}f} [{:.{}f}, {:.{}f}]", unit * *spread.median, digits,
                     unit * *spread.q10, digits, unit * *spread.q90, digits);
}

GroupSummary SummaryOf(std::vector<std::string> group, bool whole_cells,
                       const std::vector<const StoredTrial*>& members) {
  GroupSummary summary;
  summary.group = std::move(group);
  SuccessCount count(whole_cells);
  std::vector<double> times_s, errors_y_m, errors_z_m, estimate_errors_m;
  for (const StoredTrial* trial : members) {
    const trial::TrialRecord& r = trial->record;
    count.Add(*trial);
    if (r.success()) {
      times_s.push_back(r.time_s);
      estimate_errors_m.push_back(EstimateError_m(r));
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
  summary.estimate_error_m = SpreadOf(estimate_errors_m);
  return summary;
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

std::string FailureText(const GroupSummary& group) {
  std::vector<std::pair<std::string, int64_t>> sorted(group.failures.begin(), group.failures.end());
  std::ranges::stable_sort(sorted, std::greater(), &std::pair<std::string, int64_t>::second);
  std::string list;
  for (const auto& [name, count] : sorted)
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", count, name);
  return list;
}

double EstimateError_m(const trial::TrialRecord& record) {
  return (record.final_error_estimated - record.final_error_true).distance_m();
}

bool LessByValue(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  const auto place = [](const std::string& text) { return std::pair(NumberFirst(text), text); };
  return std::ranges::lexicographical_compare(a, b, {}, place, place);
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
  std::map<std::vector<std::string>, std::vector<const StoredTrial*>, decltype(&LessByValue)>
      groups(&LessByValue);
  std::vector<GroupKey> group_keys;
  if (!trials.empty())
    for (const std::string& key : keys) group_keys.emplace_back(key, trials.front());
  for (const StoredTrial& trial : trials) {
    std::vector<std::string> values;
    values.reserve(group_keys.size());
    for (const GroupKey& key : group_keys) values.push_back(key.ValueOf(trial));
    groups[values].push_back(&trial);
  }
  const bool whole_cells = std::ranges::all_of(group_keys, &GroupKey::is_planned);
  std::vector<GroupSummary> summaries;
  for (const auto& [values, members] : groups)
    summaries.push_back(SummaryOf(values, whole_cells, members));
  return summaries;
}

report::Section GroupSection(const std::vector<std::string>& keys,
                             const std::vector<GroupSummary>& groups,
                             const std::optional<double>& precision) {
  std::vector<std::string> titles;
  for (const std::string& key : keys) titles.push_back("<" + key);
  for (const char* title :
       {"trials", "success %", "Wilson", "exact", "time to dock s", "|y| mm", "|z| mm", "off mm"})
    titles.emplace_back(title);
  if (precision) titles.emplace_back("half width %");
  titles.emplace_back("<failures");
  report::Table table(titles);
  const double mm = units::MmFromM(1);
  for (const GroupSummary& group : groups) {
    std::vector<report::Cell> row(group.group.begin(), group.group.end());
    const auto rate = static_cast<double>(group.successes) / static_cast<double>(group.trials);
    for (const std::string& cell :
         {std::to_string(group.trials), report::Fixed(100 * rate, 1), PercentText(group.wilson),
          PercentText(group.clopper_pearson), SpreadText(group.time_to_dock_s, 1),
          SpreadText(group.error_true_y_m, mm), SpreadText(group.error_true_z_m, mm),
          SpreadText(group.estimate_error_m, mm, 1)})
      row.emplace_back(cell);
    if (precision)
      row.emplace_back(fmt::format("{:.1f}{}", 100 * group.wilson.half_width(),
                                   IsReached(group, *precision) ? "" : " not reached"));
    row.emplace_back(FailureText(group));
    table.Row(std::move(row));
  }
  return {.title = keys.empty() ? "All trials" : fmt::format("By {}", fmt::join(keys, ", ")),
          .note =
              "Wilson (over the plan's strata, if any), exact (Clopper-Pearson, without them): "
              "95 % intervals of the success rate in %. Off: distance of the estimated from "
              "the true position once docked. Others: median [10 %, 90 %]." +
              (precision ? fmt::format(" Half width: of Wilson's interval, to be at most {:g} "
                                       "%.",
                                       100 * *precision)
                         : ""),
          .table = table};
}

report::Json GroupsJson(const std::vector<std::string>& keys,
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
  return list;
}

}  // namespace turbidock::farm
