#include "experiments/batch/summary.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <sstream>
#include <utility>

#include "sim/base/units.h"

namespace turbidock::batch {
namespace {

Spread SpreadOf(const std::vector<double>& values) {
  return {statistics::Quantile(values, 0.1), statistics::Quantile(values, 0.5),
          statistics::Quantile(values, 0.9), std::ssize(values)};
}

std::pair<bool, double> NumberFirst(const std::string& text) {
  const double number = report::NumberIn(text).value_or(std::nan(""));
  return {!std::isfinite(number), std::isfinite(number) ? number : 0};
}

// "12 [3, 45]" in mm or whatever `unit` of them is one.
std::string SpreadText(const Spread& spread, double unit, int digits = 0) {
  if (spread.count == 0) return "-";
  return fmt::format("{:.{}f} [{:.{}f}, {:.{}f}]", unit * *spread.median, digits,
                     unit * *spread.q10, digits, unit * *spread.q90, digits);
}

// Where a key is among a trial's parameters; at the end if it is none.
auto Find(const StoredTrial& trial, const std::string& key) {
  return std::ranges::find(trial.parameters, key, &Parameter::key);
}

std::string ValueIn(const StoredTrial& trial, const std::string& key) {
  if (const auto at = Find(trial, key); at != trial.parameters.end()) return at->value;
  if (key == "outcome") return NameOf(trial.record.outcome);
  if (key == "failure") return NameOf(trial.record.failure);
  if (key == "cell") return std::to_string(trial.cell);
  std::string names = "outcome, failure, cell";
  for (const Parameter& parameter : trial.parameters) names += ", " + parameter.key;
  throw ConfigError(key + ": trials cannot be grouped by this; by " + names);
}

// Whether it tells cells or strata apart, not what their trials drew or how they went: the grid's
// keys stand before `stratum`, those that are drawn behind it.
bool IsPlanned(const StoredTrial& trial, const std::string& key) {
  return key == "cell" ||
         (key != "outcome" && key != "failure" && Find(trial, key) <= Find(trial, kStratumKey));
}

GroupSummary SummaryOf(std::vector<std::string> group, bool whole_cells,
                       const std::vector<const StoredTrial*>& members) {
  GroupSummary summary;
  summary.group = std::move(group);
  std::map<std::string, size_t> strata;  // their numbers, by name
  std::vector<statistics::RatedTrial> rated;
  std::vector<double> times_s, errors_y_m, errors_z_m, estimate_errors_m, falsely_s;
  for (const StoredTrial* trial : members) {
    const trial::TrialRecord& r = trial->record;
    if (!r.judged()) {
      ++summary.failures[NameOf(r.failure)];
      continue;
    }
    ++summary.trials;
    const auto stratum = Find(*trial, kStratumKey);
    const bool counts = whole_cells && stratum != trial->parameters.end();
    const size_t number =
        strata.try_emplace(counts ? stratum->value : "", strata.size()).first->second;
    rated.push_back({r.success(), number, r.seed});
    if (r.ended()) falsely_s.push_back(r.false_confidence_s);
    if (r.success()) {
      times_s.push_back(r.time_s);
      estimate_errors_m.push_back((r.final_error_estimated - r.final_error_true).distance_m());
    } else {
      ++summary.failures[NameOf(r.failure)];
    }
    if (!r.docked) continue;
    errors_y_m.push_back(std::abs(r.final_error_true.y_m));
    errors_z_m.push_back(std::abs(r.final_error_true.z_m));
  }
  summary.by_strata = strata.size() > 1;
  summary.wilson = statistics::SuccessInterval(rated);
  summary.successes = std::ssize(times_s);
  summary.time_to_dock_s = SpreadOf(times_s);
  summary.error_true_y_m = SpreadOf(errors_y_m);
  summary.error_true_z_m = SpreadOf(errors_z_m);
  if (!falsely_s.empty())
    summary.false_confidence_s = std::accumulate(falsely_s.begin(), falsely_s.end(), 0.0) /
                                 static_cast<double>(falsely_s.size());
  summary.estimate_error_m = SpreadOf(estimate_errors_m);
  return summary;
}

// The most frequent first.
std::vector<std::pair<std::string, int64_t>> SortedFailures(const GroupSummary& group) {
  std::vector<std::pair<std::string, int64_t>> sorted(group.failures.begin(), group.failures.end());
  std::ranges::stable_sort(sorted, std::greater(), &std::pair<std::string, int64_t>::second);
  return sorted;
}

}  // namespace

std::string FailureText(const GroupSummary& group) {
  std::string list;
  for (const auto& [name, count] : SortedFailures(group))
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", count, report::Words(name));
  return list;
}

const char* MeaningOf(trial::Failure failure) {
  using enum trial::Failure;
  switch (failure) {
    case kNone:
      return "it succeeded";
    case kDiverged:
      return "the physics gave no usable state";
    case kCollision:
      return "the vehicle touched something other than the inside of the dock";
    case kJammed:
      return "the pole was held in the dock for a while";
    case kFalseLock:
      return "the estimate that was acted on was wrong, also before a collision";
    case kNeverFound:
      return "the vehicle never began to servo";
    case kLostInServoing:
      return "the marker was lost to the end of the trial, last seen while servoing";
    case kLostInDocking:
      return "the marker was lost to the end of the trial, last seen while docking";
    case kOscillation:
      return "the vehicle swung about the desired pose when it was last under control";
    case kGaveUp:
      return "none of the others, and all attempts failed";
    case kTimeout:
      return "none of the others, and the time was up";
    case kCrashed:
      return "the trial's process ended";
    case kHung:
      return "the trial's process was stopped after its time limit";
    case kNoAnswer:
      return "a program that steers or sees for the vehicle did not answer";
  }
  return "";
}

report::Section FailureTable(const GroupSummary& group) {
  report::Table table({"<failure", "trials", "%", "<meaning"});
  double all = static_cast<double>(group.successes);  // with those that say nothing of docking
  for (const auto& [name, count] : group.failures) all += static_cast<double>(count);
  for (const auto& [name, count] : SortedFailures(group)) {
    const report::Json word = name;
    table.Row({report::Words(name), std::to_string(count),
               report::Fixed(100 * static_cast<double>(count) / all, 1),
               MeaningOf(word.get<trial::Failure>())});
  }
  report::Section section{.title = "Failures", .wide = true, .player = "failures"};
  if (table.rows().empty()) return section;
  section.note = "One word a trial: why it did not succeed.";
  section.table = table;
  return section;
}

bool LessByValue(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  const auto place = [](const std::string& text) { return std::pair(NumberFirst(text), text); };
  return std::ranges::lexicographical_compare(a, b, {}, place, place);
}

std::vector<GroupSummary> Summarise(const std::vector<StoredTrial>& trials,
                                    const std::vector<std::string>& keys) {
  std::map<std::vector<std::string>, std::vector<const StoredTrial*>, decltype(&LessByValue)>
      groups(&LessByValue);
  for (const StoredTrial& trial : trials) {
    std::vector<std::string> values;
    values.reserve(keys.size());
    for (const std::string& key : keys) values.push_back(ValueIn(trial, key));
    groups[values].push_back(&trial);
  }
  const bool whole_cells = std::ranges::all_of(keys, [&](const std::string& key) {
    return trials.empty() || IsPlanned(trials.front(), key);
  });
  std::vector<GroupSummary> summaries;
  summaries.reserve(groups.size());
  for (const auto& [values, members] : groups)
    summaries.push_back(SummaryOf(values, whole_cells, members));
  return summaries;
}

report::Quantity NameOfKey(const std::string& key) {
  std::string name = key, axis;
  if (const size_t at = key.rfind('['); at != std::string::npos && key.ends_with(']')) {
    const std::string index = key.substr(at + 1, key.size() - at - 2);
    axis = " " + (index == "0" ? "x" : index == "1" ? "y" : index == "2" ? "z" : index);
    name.erase(at);
  }
  if (name.ends_with(".use")) name.resize(name.rfind('.'));  // what is chosen of a group
  // its last word and the group around it
  const size_t last = name.rfind('.');
  const size_t group = last == std::string::npos || last == 0 ? last : name.rfind('.', last - 1);
  report::Quantity quantity =
      report::QuantityOf(group == std::string::npos ? name : name.substr(group + 1));
  std::ranges::replace(quantity.label, '.', ' ');
  quantity.label += axis;
  return quantity;
}

std::string ValueText(const std::string& key, const std::string& value) {
  if (value.starts_with('[') && value.ends_with(']')) {
    std::vector<std::string> elements;
    std::istringstream list(value.substr(1, value.size() - 2));
    for (std::string element; std::getline(list >> std::ws, element, ',');)
      elements.push_back(ValueText(key, element));
    return fmt::format("[{}]", fmt::join(elements, ", "));
  }
  const auto number = report::NumberIn(value);
  return number && (*number != std::round(*number) || NameOfKey(key).factor != 1)
             ? report::Digits(NameOfKey(key).factor * *number)
             : value;
}

std::string IntervalText(const std::vector<GroupSummary>& groups) {
  const bool is_plain = std::ranges::none_of(groups, [](const GroupSummary& g) {
    return g.wilson.AsList() != statistics::WilsonInterval(g.successes, g.trials).AsList();
  });
  if (is_plain) return "95 %, Wilson's";
  return fmt::format(
      "95 %, Wilson's{}, the trials of one seed counted as alike",
      std::ranges::any_of(groups, &GroupSummary::by_strata) ? ", by the plan's strata" : "");
}

report::Section GroupSection(const std::vector<std::string>& keys,
                             const std::vector<GroupSummary>& groups,
                             const std::optional<double>& precision) {
  std::vector<std::string> titles, names;
  for (const std::string& key : keys) {
    names.push_back(NameOfKey(key).label);
    titles.push_back("<" + NameOfKey(key).Title());
  }
  for (const char* title :
       {"trials", "success, %", "interval", "time to dock, s", "|y|, mm", "|z|, mm", "off, mm"})
    titles.emplace_back(title);
  if (precision) titles.emplace_back("half width, %");
  titles.emplace_back("<failures");
  report::Table table(titles);
  const double mm = units::MmFromM(1);
  for (const GroupSummary& group : groups) {
    std::vector<report::Cell> row;
    for (size_t i = 0; i < keys.size(); ++i) row.emplace_back(ValueText(keys[i], group.group[i]));
    for (const std::string& cell :
         {std::to_string(group.trials),
          group.trials > 0 ? report::Fixed(100 * group.rate(), 1) : "-",
          group.trials > 0
              ? fmt::format("{:.0f}-{:.0f}", 100 * group.wilson.low, 100 * group.wilson.high)
              : "-",
          SpreadText(group.time_to_dock_s, 1), SpreadText(group.error_true_y_m, mm),
          SpreadText(group.error_true_z_m, mm), SpreadText(group.estimate_error_m, mm, 1)})
      row.emplace_back(cell);
    if (precision)
      row.emplace_back(fmt::format("{:.1f}{}", 100 * group.wilson.half_width(),
                                   group.wilson.half_width() <= *precision ? "" : " not reached"));
    row.emplace_back(FailureText(group));
    table.Row(std::move(row));
  }
  return {
      .title = keys.empty() ? "All trials" : fmt::format("By {}", fmt::join(names, ", ")),
      .note = "Interval: " + IntervalText(groups) +
              ", of the success rate in %. Off: distance of the estimated from the true position "
              "once docked. Others: median [10 %, 90 %]." +
              (precision ? fmt::format(" Half width: of the interval, to be at most {:g} %.",
                                       100 * *precision)
                         : ""),
      .table = table};
}

report::Json GroupsJson(const std::vector<std::string>& keys,
                        const std::vector<GroupSummary>& groups) {
  report::Json list = groups;
  for (report::Json& group : list) {
    const report::Json values = std::exchange(group["group"], report::Json::object());
    for (size_t i = 0; i < keys.size(); ++i) group["group"][keys[i]] = values[i];
  }
  return list;
}

// ------------------------------------------------------------------------------ success over a key

namespace {

// "lqg", but "current gust std 50 mm/s": a number alone does not say of what.
std::string NamedValue(const std::string& key, const std::string& value) {
  if (!report::NumberIn(value)) return value;
  const report::Quantity name = NameOfKey(key);
  return name.label + " " + name.Text(ValueText(key, value));
}

// "falls to 50 % at 62.1 [58.3, 66] ml/m³", or that it does not.
std::string CrossingText(const SuccessCurve& curve, const report::Quantity& x) {
  if (!curve.fit) {
    const auto [low, high] = std::ranges::minmax(
        curve.points, {}, [](const SuccessPoint& p) { return p.trials.rate(); });
    if (low.trials.rate() > 0.5) return "above 50 % everywhere";
    if (high.trials.rate() < 0.5) return "below 50 % everywhere";
    return "has no trend that crosses 50 % within the values tried";
  }
  return fmt::format(
      "{} to 50 % at {}", curve.fit->slope < 0 ? "falls" : "rises",
      x.Text(fmt::format("{} [{}, {}]", report::Digits(x.factor * curve.fit->half_x, 3),
                         report::Digits(x.factor * curve.fit->half_low, 3),
                         report::Digits(x.factor * curve.fit->half_high, 3))));
}

// A dot with a bar for each point of each curve, over x in a person's unit, and the fitted curve.
// Points stand side by side where curves share a value, or their intervals would hide each other.
report::Panel SuccessPanel(const report::Quantity& x, const std::vector<SuccessCurve>& curves) {
  double low = 1e300, high = -1e300;
  for (const SuccessCurve& curve : curves) {
    low = std::min(low, x.factor * curve.points.front().x);
    high = std::max(high, x.factor * curve.points.back().x);
  }
  const double margin = high > low ? 0.03 * (high - low) : 1;
  report::Panel panel{.title = "Success",
                      .x = {x.Title(), low - margin, high + margin},
                      .y = {"success, %", -3, 103},
                      .rules = {{50}},
                      .legend = true};
  const double middle = (static_cast<double>(curves.size()) - 1) / 2;
  for (size_t i = 0; i < curves.size(); ++i) {
    const SuccessCurve& curve = curves[i];
    const double shift = 0.005 * (high - low) * (static_cast<double>(i) - middle);
    const auto rate = [&](const SuccessPoint& p) {
      return report::SampleWithin(x.factor * p.x + shift, p.trials.rate(), p.trials.wilson, 100);
    };
    panel.series.push_back({curve.name.empty() ? "success" : curve.name,
                            report::SamplesOf(curve.points, rate), report::CurveColor(i),
                            report::Mark::kBars});
  }
  for (size_t i = 0; i < curves.size(); ++i) {
    const SuccessCurve& curve = curves[i];
    if (!curve.fit) continue;
    const auto fitted = [&](double at) {
      return report::Sample{x.factor * at, 100 * curve.fit->At(at)};
    };
    const auto xs = report::Evenly(curve.points.front().x, curve.points.back().x, 100);
    panel.series.push_back(
        {"", report::SamplesOf(xs, fitted), report::CurveColor(i), report::Mark::kDashes});
  }
  return panel;
}

}  // namespace

std::vector<SuccessCurve> SuccessCurves(const std::vector<StoredTrial>& trials,
                                        const std::string& over,
                                        const std::vector<std::string>& by) {
  std::vector<std::string> keys = by;
  keys.push_back(over);
  std::vector<SuccessCurve> curves;
  std::vector<std::string> values;
  for (GroupSummary& group : Summarise(trials, keys)) {
    const auto x = report::NumberIn(group.group.back());
    if (!x)
      throw ConfigError(
          over + ": '" + group.group.back() + "' is no number, so nothing can be drawn over it" +
          (group.group.back().starts_with("[") ? "; vary one of its components, KEY[0]" : ""));
    group.group.pop_back();
    if (curves.empty() || group.group != values) {
      values = group.group;
      std::vector<std::string> names;
      for (size_t i = 0; i < values.size(); ++i) names.push_back(NamedValue(by[i], values[i]));
      curves.push_back({.name = fmt::format("{}", fmt::join(names, ", "))});
    }
    if (group.trials > 0) curves.back().points.push_back({*x, std::move(group)});
  }
  for (SuccessCurve& curve : curves) {
    std::vector<statistics::BinomialPoint> counts;
    for (const SuccessPoint& p : curve.points)
      counts.push_back({p.x, p.trials.successes, p.trials.trials});
    curve.fit = statistics::FitLogistic(counts);
  }
  return curves;
}

report::Section SuccessSection(const std::string& over, const std::vector<std::string>& by,
                               const std::vector<SuccessCurve>& curves) {
  const report::Quantity x = NameOfKey(over);
  std::vector<std::string> names;
  names.reserve(by.size());
  for (const std::string& key : by) names.push_back(NameOfKey(key).label);
  std::vector<GroupSummary> groups;
  for (const SuccessCurve& curve : curves)
    for (const SuccessPoint& point : curve.points) groups.push_back(point.trials);
  report::Section section{
      .title = fmt::format("Success over {}{}", x.label,
                           by.empty() ? "" : fmt::format(", by {}", fmt::join(names, ", "))),
      .note =
          "Points: the values that were run, with intervals (" + IntervalText(groups) +
          "). Dashed, between them: a logistic curve fitted with Firth's correction, of which the "
          "50 % point is."};
  if (curves.empty()) return section;
  for (const SuccessCurve& curve : curves)
    section.lines.push_back(
        fmt::format("{} {}", curve.name.empty() ? "success" : curve.name, CrossingText(curve, x)));
  section.panels.push_back(SuccessPanel(x, curves));
  return section;
}

}  // namespace turbidock::batch
