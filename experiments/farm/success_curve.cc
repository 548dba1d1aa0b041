#include "experiments/farm/success_curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "experiments/farm/summary.h"
#include "sim/base/units.h"

namespace turbidock::farm {
namespace {

using report::Json;

double Number(const std::string& key, const std::string& text) {
  if (const auto number = report::NumberIn(text)) return *number;
  throw ConfigError(key + ": '" + text + "' is no number, so nothing can be drawn over it");
}

std::optional<PositionError> ErrorOf(const std::vector<double>& errors_m) {
  if (errors_m.empty()) return std::nullopt;
  const auto [least, most] = std::ranges::minmax(errors_m);
  return PositionError{*statistics::Median(errors_m), statistics::MedianInterval(errors_m).value_or(
                                                          statistics::Interval{least, most})};
}

double Rate(const SuccessPoint& point) {
  return static_cast<double>(point.successes) / static_cast<double>(point.trials);
}

std::string HalfText(const statistics::LogisticFit& fit) {
  return fmt::format("50 % at {:.3g} [{:.3g}, {:.3g}]", fit.half_dose, fit.half_low, fit.half_high);
}

// Side by side where curves share a value, or their intervals would hide each other.
double Shifted(double x, size_t curve, size_t curves, double width) {
  return x + 0.005 * width * (static_cast<double>(curve) - (static_cast<double>(curves) - 1) / 2);
}

report::Axis AxisOver(const std::string& over, const std::vector<SuccessCurve>& curves) {
  double low = curves[0].points[0].dose, high = low;
  for (const SuccessCurve& curve : curves) {
    low = std::min(low, curve.points.front().dose);
    high = std::max(high, curve.points.back().dose);
  }
  const double margin = high > low ? 0.03 * (high - low) : 1;
  return {over, low - margin, high + margin};
}

report::Panel SuccessPanel(const report::Axis& axis, const std::vector<SuccessCurve>& curves) {
  report::Panel panel{.title = "Docked",
                      .x = axis,
                      .y = {"docked, %", -3, 103},
                      .rules = {{50}},
                      .legend = report::Legend::kAbove};
  for (size_t i = 0; i < curves.size(); ++i) {
    const SuccessCurve& curve = curves[i];
    const auto counted = [&](const SuccessPoint& p) {
      return report::SampleWithin(Shifted(p.dose, i, curves.size(), axis.high - axis.low), Rate(p),
                                  p.wilson, 100);
    };
    const std::string name = curve.name.empty() ? "docked" : curve.name;
    panel.series.push_back({curve.fit ? name + ", " + HalfText(*curve.fit) : name,
                            report::SamplesOf(curve.points, counted), report::CurveColor(i),
                            report::Mark::kBars});
    if (!curve.fit) continue;
    const auto fitted = [&](double x) { return report::Sample{x, 100 * curve.fit->At(x)}; };
    const auto xs = report::Evenly(curve.points.front().dose, curve.points.back().dose, 100);
    panel.series.push_back({"", report::SamplesOf(xs, fitted), report::CurveColor(i)});
  }
  return panel;
}

report::Panel ErrorPanel(const report::Axis& axis, const std::vector<SuccessCurve>& curves) {
  report::Panel panel{.title = "Error of the estimated position once docked",
                      .x = axis,
                      .y = {.label = "median, mm", .logarithmic = true},
                      .legend = report::Legend::kAbove};
  for (size_t i = 0; i < curves.size(); ++i) {
    const auto sample = [&](const SuccessPoint& p) {
      if (!p.error) return report::Sample{};
      return report::SampleWithin(Shifted(p.dose, i, curves.size(), axis.high - axis.low),
                                  p.error->median_m, p.error->interval_m, units::MmFromM(1));
    };
    panel.series.push_back({curves[i].name, report::SamplesOf(curves[i].points, sample),
                            report::CurveColor(i), report::Mark::kLineWithBars});
  }
  return panel;
}

bool HasErrors(const SuccessCurve& curve) {
  return std::ranges::any_of(
      curve.points, [](const SuccessPoint& p) { return p.error && p.error->median_m > 0; });
}

}  // namespace

std::string SuccessCurve::CrossingText() const {
  if (!fit) return "does not cross 50 % within the values tried";
  return (fit->slope < 0 ? "falls to " : "rises to ") + HalfText(*fit);
}

std::vector<SuccessCurve> SuccessCurves(const std::vector<StoredTrial>& trials,
                                        const std::string& over,
                                        const std::vector<std::string>& by) {
  if (trials.empty()) return {};
  struct AtValue {
    SuccessCount count;
    std::vector<double> errors_m;
  };
  std::map<std::vector<std::string>, std::map<double, AtValue>, decltype(&LessByValue)> all(
      &LessByValue);
  const GroupKey over_key(over, trials.front());
  std::vector<GroupKey> by_keys;
  for (const std::string& key : by) by_keys.emplace_back(key, trials.front());
  const bool whole_cells =
      over_key.is_planned() && std::ranges::all_of(by_keys, &GroupKey::is_planned);
  for (const StoredTrial& trial : trials) {
    std::vector<std::string> name;
    for (const GroupKey& key : by_keys) name.push_back(key.ValueOf(trial));
    const double x = Number(over, over_key.ValueOf(trial));
    AtValue& there = all[name].emplace(x, AtValue{SuccessCount(whole_cells), {}}).first->second;
    there.count.Add(trial);
    if (trial.record.success()) there.errors_m.push_back(EstimateError_m(trial.record));
  }
  std::vector<SuccessCurve> curves;
  for (const auto& [name, points] : all) {
    SuccessCurve& curve = curves.emplace_back();
    curve.name = fmt::format("{}", fmt::join(name, ", "));
    for (const auto& [x, there] : points) {
      const auto [successes, count] = there.count.all();
      curve.points.push_back(
          {{x, successes, count}, there.count.Wilson(), ErrorOf(there.errors_m)});
    }
    curve.fit = statistics::FitLogistic({curve.points.begin(), curve.points.end()});
  }
  return curves;
}

report::Section SuccessSection(const std::string& over, const std::vector<std::string>& by,
                               const std::vector<SuccessCurve>& curves) {
  report::Section section{
      .title = fmt::format("Success over {}{}", over,
                           by.empty() ? "" : fmt::format(", by {}", fmt::join(by, ", "))),
      .note =
          "95 % intervals: Wilson's, over the plan's strata, if any. The 50 % point is of a "
          "logistic curve fitted with Firth's correction."};
  if (curves.empty()) return section;
  for (const SuccessCurve& curve : curves)
    section.lines.push_back(
        fmt::format("{} {}", curve.name.empty() ? "success" : curve.name, curve.CrossingText()));
  const report::Axis axis = AxisOver(over, curves);
  section.panels.push_back(SuccessPanel(axis, curves));
  if (std::ranges::any_of(curves, HasErrors)) section.panels.push_back(ErrorPanel(axis, curves));
  return section;
}

Json SuccessJson(const std::string& over, const std::vector<SuccessCurve>& curves) {
  Json list = Json::array();
  for (const SuccessCurve& curve : curves) {
    Json points = Json::array();
    for (const SuccessPoint& p : curve.points) {
      points.push_back(
          {{over, p.dose},
           {"trials", p.trials},
           {"successes", p.successes},
           {"wilson", p.wilson},
           {"clopper_pearson", statistics::ClopperPearsonInterval(p.successes, p.trials)}});
      if (p.error)
        points.back()["position_error_m"] = {{"median", p.error->median_m},
                                             {"interval", p.error->interval_m}};
    }
    Json half;
    if (curve.fit)
      half = {{"at", curve.fit->half_dose},
              {"low", curve.fit->half_low},
              {"high", curve.fit->half_high}};
    list.push_back({{"name", curve.name}, {"points", points}, {"half", half}});
  }
  return list;
}

}  // namespace turbidock::farm
