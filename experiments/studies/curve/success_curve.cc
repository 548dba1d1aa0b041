#include "experiments/studies/curve/success_curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "experiments/farm/summary.h"
#include "experiments/media/figure.h"
#include "experiments/report/json.h"
#include "experiments/report/table.h"

namespace turbidock::curve {
namespace {

using report::Json;

double Number(const std::string& key, const std::string& text) {
  if (const auto number = report::NumberIn(text)) return *number;
  throw ConfigError(key + ": '" + text + "' is no number, so nothing can be drawn over it");
}

std::vector<ErrorPoint> ErrorPoints(const std::map<double, std::vector<double>>& errors_m) {
  std::vector<ErrorPoint> points;
  for (const auto& [dose, errors] : errors_m) {
    const auto [least, most] = std::ranges::minmax(errors);
    points.push_back(
        {dose, *statistics::Median(errors),
         statistics::MedianInterval(errors).value_or(statistics::Interval{least, most})});
  }
  return points;
}

double Rate(const SuccessPoint& point) {
  return static_cast<double>(point.successes) / static_cast<double>(point.trials);
}

// The errors over the same doses as the success.
report::Panel ErrorPanel(const report::Panel& success, const std::vector<SuccessCurve>& curves,
                         double shift) {
  report::Panel panel{
      .x = success.x,
      .y = {"position error of the estimate once docked, mm (median)", 0.3, 300, true},
      .legend = report::Legend::kAbove};
  for (size_t i = 0; i < curves.size(); ++i) {
    const double moved = shift * static_cast<double>(i);
    const auto sample = [&](const ErrorPoint& p) {
      return report::SampleWithin(p.dose + moved, p.median_m, p.interval_m, 1000);
    };
    panel.series.push_back({curves[i].name, report::SamplesOf(curves[i].errors, sample),
                            report::CurveColor(i), report::Mark::kLineWithBars});
  }
  return panel;
}

const ErrorPoint* ErrorAt(const SuccessCurve& curve, double dose) {
  const auto at = std::ranges::find(curve.errors, dose, &ErrorPoint::dose);
  return at == curve.errors.end() ? nullptr : &*at;
}

std::string ErrorText(const SuccessCurve& curve, double dose) {
  const ErrorPoint* error = ErrorAt(curve, dose);
  if (!error) return "";
  const auto [low_m, high_m] = error->interval_m;
  return fmt::format("{:.1f} [{:.1f}, {:.1f}]", 1e3 * error->median_m, 1e3 * low_m, 1e3 * high_m);
}

std::string HalfText(const SuccessCurve& curve) {
  if (!curve.fit) return "does not fall to 50 % within the values tried";
  return fmt::format("falls to 50 % at {:.3g} [{:.3g}, {:.3g}]", curve.fit->half_dose,
                     curve.fit->half_low, curve.fit->half_high);
}

}  // namespace

std::vector<SuccessCurve> SuccessCurves(const std::vector<farm::StoredTrial>& trials,
                                        const std::string& over, const std::string& by) {
  std::map<std::string, std::map<double, farm::SuccessCount>> counts;
  std::map<std::string, std::map<double, std::vector<double>>> errors_m;
  if (trials.empty()) return {};
  const farm::GroupKey over_key(over, trials.front());
  std::optional<farm::GroupKey> by_key;
  if (!by.empty()) by_key.emplace(by, trials.front());
  const bool whole_cells = over_key.is_planned() && (!by_key || by_key->is_planned());
  for (const farm::StoredTrial& trial : trials) {
    const double dose = Number(over, over_key.ValueOf(trial));
    const std::string name = by_key ? by_key->ValueOf(trial) : "";
    counts[name].try_emplace(dose, whole_cells).first->second.Add(trial);
    const trial::TrialRecord& record = trial.record;
    if (record.success())
      errors_m[name][dose].push_back(
          (record.final_error_estimated - record.final_error_true).distance_m());
  }
  std::vector<SuccessCurve> curves;
  for (const auto& [name, points] : counts) {
    SuccessCurve curve{name, {}, std::nullopt, ErrorPoints(errors_m[name])};
    for (const auto& [dose, count] : points) {
      const statistics::Count all = count.all();
      curve.points.push_back({{dose, all.successes, all.trials}, count.Wilson()});
    }
    curve.fit = statistics::FitLogistic({curve.points.begin(), curve.points.end()});
    curves.push_back(std::move(curve));
  }
  return curves;
}

std::string SuccessTable(const std::string& over, const std::vector<SuccessCurve>& curves) {
  report::Table table({"<", over, "trials", "success %", "<Wilson", "<exact", "<off, mm"});
  for (const SuccessCurve& curve : curves)
    for (const SuccessPoint& p : curve.points)
      table.Row({curve.name, FormatNumber(p.dose), std::to_string(p.trials),
                 report::Fixed(100 * Rate(p), 1), farm::PercentText(p.wilson),
                 farm::PercentText(statistics::ClopperPearsonInterval(p.successes, p.trials)),
                 ErrorText(curve, p.dose)});
  std::string text = table.Text();
  for (const SuccessCurve& curve : curves)
    text +=
        fmt::format("{}{}\n", curve.name.empty() ? "success " : curve.name + " ", HalfText(curve));
  return text +
         "95 % intervals, Wilson's over the plan's strata, if any. The 50 % point is of a logistic "
         "curve\nfitted with Firth's correction, as if there were none.\n"
         "Off: distance of the estimated from the true position once docked, median.\n";
}

std::string SuccessJson(const std::string& over, const std::vector<SuccessCurve>& curves) {
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
      if (const ErrorPoint* error = ErrorAt(curve, p.dose))
        points.back()["position_error_m"] = {{"median", error->median_m},
                                             {"interval", error->interval_m}};
    }
    Json half;
    if (curve.fit)
      half = {{"at", curve.fit->half_dose},
              {"low", curve.fit->half_low},
              {"high", curve.fit->half_high}};
    list.push_back({{"name", curve.name}, {"points", points}, {"half", half}});
  }
  return report::JsonText(list);
}

void WriteSuccessFigure(const std::string& path, const std::string& title, const std::string& over,
                        const std::vector<SuccessCurve>& curves, bool with_errors) {
  double low = curves.front().points.front().dose, high = low;
  for (const SuccessCurve& curve : curves) {
    low = std::min(low, curve.points.front().dose);
    high = std::max(high, curve.points.back().dose);
  }
  const double margin = high > low ? 0.03 * (high - low) : 1;
  report::Panel panel{.x = {over, low - margin, high + margin},
                      .y = {"success rate, % (95 % intervals)", -3, 103},
                      .rules = {{50}},
                      .legend = report::Legend::kAbove};
  for (size_t i = 0; i < curves.size(); ++i) {
    const SuccessCurve& curve = curves[i];
    // Side by side where curves share a value, or their intervals would hide each other.
    const double shift =
        margin / 6 * (static_cast<double>(i) - (static_cast<double>(curves.size()) - 1) / 2);
    const auto counted = [&](const SuccessPoint& p) {
      return report::SampleWithin(p.dose + shift, Rate(p), p.wilson, 100);
    };
    const auto fitted = [&](double dose) {
      return report::Sample{dose, 100 * curve.fit->At(dose)};
    };
    panel.series.push_back({(curve.name.empty() ? "success" : curve.name) + ": " + HalfText(curve),
                            report::SamplesOf(curve.points, counted), report::CurveColor(i),
                            report::Mark::kBars});
    if (curve.fit)
      panel.series.push_back(
          {"", report::SamplesOf(report::Evenly(low, high, 300), fitted), report::CurveColor(i)});
  }
  report::Figure figure{.title = title, .panels = {panel}};
  if (with_errors) {
    figure.columns = 2;
    figure.panels.push_back(ErrorPanel(panel, curves, margin / 6));
  }
  media::WriteFigure(path, figure);
}

}  // namespace turbidock::curve
