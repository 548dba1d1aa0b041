#include "experiments/batch/success_curve.h"

#include <fmt/format.h>

#include <algorithm>

#include "sim/base/units.h"

namespace turbidock::batch {
namespace {

// "falls to 50 % at 62.1 [58.3, 66] ml/m³", or that it does not.
std::string CrossingText(const SuccessCurve& curve, const report::Quantity& x) {
  if (!curve.fit) return "does not cross 50 % within the values tried";
  return fmt::format("{} to 50 % at {:.3g} [{:.3g}, {:.3g}] {}",
                     curve.fit->slope < 0 ? "falls" : "rises", x.factor * curve.fit->half_x,
                     x.factor * curve.fit->half_low, x.factor * curve.fit->half_high, x.unit);
}

// Over x in a person's unit. Points stand side by side where curves share a value, or their
// intervals would hide each other.
class Chart {
 public:
  Chart(const std::string& over, const std::vector<SuccessCurve>& curves)
      : x_(NameOfKey(over)), curves_(curves) {
    for (const SuccessCurve& curve : curves) {
      low_ = std::min(low_, x_.factor * curve.points.front().x);
      high_ = std::max(high_, x_.factor * curve.points.back().x);
    }
  }

  report::Panel Success() const {
    report::Panel panel = Empty("Docked", {"docked, %", -3, 103});
    panel.rules = {{50}};
    for (size_t i = 0; i < curves_.size(); ++i) {
      const SuccessCurve& curve = curves_[i];
      AddPoints(i, curve.name.empty() ? "docked" : curve.name, &panel, [](const GroupSummary& g) {
        return report::SampleWithin(0, g.rate(), g.wilson, 100);
      });
      if (!curve.fit) continue;
      const auto fitted = [&](double x) {
        return report::Sample{x_.factor * x, 100 * curve.fit->At(x)};
      };
      const auto xs = report::Evenly(curve.points.front().x, curve.points.back().x, 100);
      panel.series.push_back(
          {"", report::SamplesOf(xs, fitted), report::CurveColor(i), report::Mark::kDashes});
    }
    return panel;
  }

  report::Panel Error() const {
    report::Panel panel = Empty("Error of the estimated position once docked",
                                {.label = "median, 10 % and 90 %, mm", .logarithmic = true});
    for (size_t i = 0; i < curves_.size(); ++i)
      AddPoints(i, curves_[i].name, &panel, [](const GroupSummary& g) {
        const Spread& error = g.estimate_error_m;
        if (error.count == 0) return report::Sample{};
        const statistics::Interval within{*error.q10, *error.q90};
        return report::SampleWithin(0, *error.median, within, units::MmFromM(1));
      });
    return panel;
  }

 private:
  report::Panel Empty(const std::string& title, const report::Axis& y) const {
    const double margin = high_ > low_ ? 0.03 * (high_ - low_) : 1;
    return {.title = title,
            .x = {x_.Title(), low_ - margin, high_ + margin},
            .y = y,
            .legend = report::Legend::kAbove};
  }

  template <class Of>
  void AddPoints(size_t i, const std::string& name, report::Panel* panel, const Of& of) const {
    const double shift = 0.005 * (high_ - low_) *
                         (static_cast<double>(i) - (static_cast<double>(curves_.size()) - 1) / 2);
    const auto sample = [&](const SuccessPoint& p) {
      report::Sample at = of(p.trials);
      at.x = x_.factor * p.x + shift;
      return at;
    };
    panel->series.push_back({name, report::SamplesOf(curves_[i].points, sample),
                             report::CurveColor(i), report::Mark::kBars});
  }

  report::Quantity x_;
  const std::vector<SuccessCurve>& curves_;
  double low_ = 1e300, high_ = -1e300;
};

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
      throw ConfigError(over + ": '" + group.group.back() +
                        "' is no number, so nothing can be drawn over it");
    group.group.pop_back();
    if (curves.empty() || group.group != values) {
      values = group.group;
      curves.push_back(
          {.name = fmt::format("{}", fmt::join(values, ", ")), .points = {}, .fit = {}});
    }
    curves.back().points.push_back({*x, std::move(group)});
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
  for (const std::string& key : by) names.push_back(NameOfKey(key).label);
  report::Section section{
      .title = fmt::format("Success over {}{}", x.label,
                           by.empty() ? "" : fmt::format(", by {}", fmt::join(names, ", "))),
      .note =
          "Points: the values that were run, with 95 % intervals (Wilson's, over the plan's "
          "strata, if any). Dashed, between them: a logistic curve fitted with Firth's "
          "correction, of which the 50 % point is."};
  if (curves.empty()) return section;
  for (const SuccessCurve& curve : curves)
    section.lines.push_back(
        fmt::format("{} {}", curve.name.empty() ? "success" : curve.name, CrossingText(curve, x)));
  const Chart chart(over, curves);
  section.panels.push_back(chart.Success());
  const auto has_errors = [](const SuccessCurve& curve) {
    return std::ranges::any_of(curve.points, [](const SuccessPoint& p) {
      return p.trials.estimate_error_m.median.value_or(0) > 0;
    });
  };
  if (std::ranges::any_of(curves, has_errors)) section.panels.push_back(chart.Error());
  return section;
}

report::Json SuccessJson(const std::string& over, const std::vector<SuccessCurve>& curves) {
  report::Json list = report::Json::array();
  for (const SuccessCurve& curve : curves) {
    report::Json points = report::Json::array();
    for (const SuccessPoint& p : curve.points) {
      report::Json point = {{over, p.x}};
      point.update(report::Json(p.trials));
      point.erase("group");
      points.push_back(point);
    }
    report::Json half;
    if (curve.fit)
      half = {
          {"at", curve.fit->half_x}, {"low", curve.fit->half_low}, {"high", curve.fit->half_high}};
    list.push_back({{"name", curve.name}, {"points", points}, {"half", half}});
  }
  return list;
}

}  // namespace turbidock::batch
