// The pictures of an envelope: rates along the ranges, maps of two of them, trials as points.

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "experiments/batch/envelope.h"
#include "experiments/batch/summary.h"

namespace turbidock::batch {
namespace {

using report::kOpen;
using search::Side;

constexpr Rgb kAboveColor{0, 158, 115};

// A lattice and the values of its ranges in a person's unit.
class Places {
 public:
  explicit Places(const EnvelopePlan& plan) : plan_(plan), lattice_(plan.Search().lattice) {}

  const search::Lattice& lattice() const { return lattice_; }
  report::Quantity Name(size_t range) const { return NameOfKey(plan_.ranges[range].key); }
  double At(size_t range, double place) const {
    const int last = lattice_.axes[range].values - 1;
    return Name(range).factor * plan_.ranges[range].At(std::clamp(place / last, 0.0, 1.0));
  }
  // The whole range, or with half a cell around it.
  report::Axis Axis(size_t range) const {
    const double from = At(range, 0), to = At(range, lattice_.axes[range].values - 1);
    return {.label = Name(range).Title(),
            .low = std::min(from, to),
            .high = std::max(from, to),
            .logarithmic = plan_.ranges[range].scale == Scale::kLogarithmic};
  }
  double percent() const { return 100 * plan_.find.rate; }
  size_t ranges() const { return plan_.ranges.size(); }

 private:
  const EnvelopePlan& plan_;
  search::Lattice lattice_;
};

// From -0.4 to 0.4, by the sample: trials of a cell stand side by side.
double Aside(const StoredTrial& trial, int range) {
  constexpr std::array kShares{0.6180339887, 0.7548776662};
  const double turns = kShares.at(static_cast<size_t>(range)) * static_cast<double>(trial.sample);
  return 0.8 * (turns - std::floor(turns)) - 0.4;
}

// Trials as points, docked and by failure. `place`: x and y.
template <class Place>
void AddTrials(const std::vector<const StoredTrial*>& trials, const Place& place,
               report::Panel* panel) {
  std::map<std::string, report::Series> failures;
  report::Series docked{.name = "docked", .color = kAboveColor, .mark = report::Mark::kDots};
  for (const StoredTrial* trial : trials) {
    const bool success = trial->record.success();
    const std::string name = report::Words(NameOf(trial->record.failure));
    report::Series& series = success ? docked : failures[name];
    const std::optional<report::Sample> at = place(*trial);
    if (!at) continue;
    series.name = success ? docked.name : name;
    series.points.push_back(*at);
    series.links.push_back(TrialLink(trial->trial));
  }
  docked.dot_px = 4;
  docked.opacity = 0.6;
  panel->series.push_back(std::move(docked));
  size_t color = 0;
  constexpr std::array kFailureColors{1, 3, 4, 5, 6, 7};
  for (auto& [name, series] : failures) {
    series.color =
        report::CurveColor(static_cast<size_t>(kFailureColors.at(color++ % kFailureColors.size())));
    series.mark = report::Mark::kRings;
    series.dot_px = 5;
    panel->series.push_back(std::move(series));
  }
}

// The rate along a range through a cell, with its band.
void AddRate(const Places& places, const Envelope& envelope, size_t range, int first, Rgb color,
             const std::string& name, report::Panel* panel) {
  report::Series band{.name = "", .color = color, .mark = report::Mark::kBand, .opacity = 0.25};
  report::Series line{.name = name, .color = color};
  const search::Boundary& b = envelope.boundary;
  for (int i = 0; i < places.lattice().axes[range].values; ++i) {
    const int place = first + i * places.lattice().Step(range);
    const auto cell = static_cast<size_t>(place);
    const double x = places.At(range, i);
    band.points.push_back({x, 100 * b.rate[cell], 100 * b.low[cell], 100 * b.high[cell]});
    line.points.push_back({x, 100 * b.rate[cell]});
  }
  panel->series.push_back(std::move(band));
  panel->series.push_back(std::move(line));
}

// A cell in the middle of all ranges but one, at whose beginning it is; and the words for it.
std::pair<int, std::string> MiddleOf(const Places& places, size_t range) {
  int first = 0;
  std::vector<std::string> words;
  for (size_t k = 0; k < places.ranges(); ++k) {
    if (k == range) continue;
    const int at = (places.lattice().axes[k].values - 1) / 2;
    first += at * places.lattice().Step(k);
    words.push_back(places.Name(k).label + " " +
                    places.Name(k).Text(report::Digits(places.At(k, at))));
  }
  return {first, fmt::format("{}", fmt::join(words, ", "))};
}

report::Panel RatePanel(const Places& places, size_t range) {
  const auto [first, words] = MiddleOf(places, range);
  return {.title = words.empty() ? "Success" : "Success at " + words,
          .x = places.Axis(range),
          .y = {"success, %", -8, 108},
          .rules = {{.at = places.percent()}},
          .legend = true};
}

// Between which values cells are undecided along a range, as blocks.
void AddUndecided(const Places& places, const Envelope& envelope, size_t range, int first,
                  double from_y, double to_y, report::Panel* panel) {
  const int count = places.lattice().axes[range].values;
  const auto is_open = [&](int i) {
    const int place = first + i * places.lattice().Step(range);
    return i < count && envelope.boundary.sides[static_cast<size_t>(place)] == Side::kUndecided;
  };
  for (int i = 0; i < count; ++i) {
    if (!is_open(i)) continue;
    const int begin = i;
    while (is_open(i + 1)) ++i;
    const auto [low, high] =
        std::minmax({places.At(range, begin - 0.5), places.At(range, i + 0.5)});
    // the text above says what the band is; a name in it would cover trials
    panel->blocks.push_back(
        {.from_x = low, .to_x = high, .from_y = from_y, .to_y = to_y, .opacity = 0.3});
  }
}

// The contour of the median in the plane of the first two ranges, as separate short lines.
report::Series ContourOf(const Places& places, const Envelope& envelope, int slice, Rgb color,
                         const std::string& name) {
  const search::Lattice& lattice = places.lattice();
  const double level = places.percent() / 100;
  report::Series series{.name = name, .color = color};
  const auto rate = [&](int i, int j) {
    const int cell = i * lattice.Step(0) + j * lattice.Step(1) + slice;
    return envelope.boundary.rate[static_cast<size_t>(cell)] - level;
  };
  for (int i = 0; i + 1 < lattice.axes[0].values; ++i)
    for (int j = 0; j + 1 < lattice.axes[1].values; ++j) {
      constexpr std::array<std::array<int, 2>, 5> kRound{{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}};
      std::vector<report::Sample> ends;
      for (size_t k = 0; k + 1 < kRound.size(); ++k) {
        const auto [ai, aj] = kRound[k];
        const auto [bi, bj] = kRound[k + 1];
        const double a = rate(i + ai, j + aj), b = rate(i + bi, j + bj);
        if ((a >= 0) == (b >= 0)) continue;
        const double share = a / (a - b);
        ends.push_back(
            {places.At(0, i + ai + share * (bi - ai)), places.At(1, j + aj + share * (bj - aj))});
      }
      for (size_t k = 0; k + 1 < ends.size(); k += 2)
        series.points.insert(series.points.end(), {ends[k], ends[k + 1], {}});
    }
  return series;
}

report::Panel MapPanel(const Places& places, const std::string& title) {
  return {.title = title, .x = places.Axis(0), .y = places.Axis(1), .legend = true};
}

// A slice of the lattice over its first two ranges. `at` is its place on the third, if there is
// one.
report::Panel MapOf(const Places& places, const Envelope& envelope, int at) {
  const search::Lattice& lattice = places.lattice();
  const bool is_slice = places.ranges() > 2;
  report::Panel panel =
      MapPanel(places, is_slice ? fmt::format("{} {}", places.Name(2).label,
                                              places.Name(2).Text(report::Digits(places.At(2, at))))
                                : envelope.name);
  for (int j = 0; j < lattice.axes[1].values; ++j) {
    const auto [low, high] = std::minmax({places.At(1, j - 0.5), places.At(1, j + 0.5)});
    AddUndecided(places, envelope, 0, j * lattice.Step(1) + (is_slice ? at : 0), low, high, &panel);
  }
  panel.series.push_back(ContourOf(places, envelope, is_slice ? at : 0, report::CurveColor(0),
                                   fmt::format("{:g} %", places.percent())));
  AddTrials(
      envelope.shown,
      [&](const StoredTrial& trial) -> std::optional<report::Sample> {
        const std::vector<int> cell = lattice.At(static_cast<int>(trial.cell % lattice.cells()));
        constexpr int kNear = 1;  // shown in a slice's picture
        if (is_slice && std::abs(cell[2] - at) > kNear) return std::nullopt;
        return report::Sample{places.At(0, cell[0] + Aside(trial, 0)),
                              places.At(1, cell[1] + Aside(trial, 1))};
      },
      &panel);
  return panel;
}

report::Panel CurveOf(const Places& places, const Envelope& envelope) {
  report::Panel panel = RatePanel(places, 0);
  if (!envelope.name.empty()) panel.title = envelope.name;
  AddUndecided(places, envelope, 0, 0, kOpen, kOpen, &panel);
  AddRate(places, envelope, 0, 0, report::CurveColor(0), "success", &panel);
  AddTrials(
      envelope.shown,
      [&](const StoredTrial& trial) -> std::optional<report::Sample> {
        constexpr double kAboveAll = 104, kBelowAll = -4;
        const int cell = static_cast<int>(trial.cell % places.lattice().cells());
        return report::Sample{places.At(0, cell + Aside(trial, 0)),
                              trial.record.success() ? kAboveAll : kBelowAll};
      },
      &panel);
  return panel;
}

// All boundaries in one picture.
report::Panel TogetherOf(const Places& places, const std::vector<Envelope>& envelopes) {
  const bool is_curve = places.ranges() == 1;
  const int slice = places.ranges() > 2 ? (places.lattice().axes[2].values - 1) / 2 : 0;
  report::Panel panel = is_curve ? RatePanel(places, 0) : MapPanel(places, "All boundaries");
  if (places.ranges() > 2)
    panel.title += fmt::format(" at {} {}", places.Name(2).label,
                               places.Name(2).Text(report::Digits(places.At(2, slice))));
  for (size_t i = 0; i < envelopes.size(); ++i) {
    if (is_curve)
      AddRate(places, envelopes[i], 0, 0, report::CurveColor(i), envelopes[i].name, &panel);
    else
      panel.series.push_back(
          ContourOf(places, envelopes[i], slice, report::CurveColor(i), envelopes[i].name));
  }
  return panel;
}

}  // namespace

std::string TrialLink(int64_t trial) { return fmt::format("trial {}", trial); }

report::Section EnvelopeSection(const EnvelopeSummary& summary) {
  const Places places(summary.plan);
  report::Section section{
      .title = fmt::format("Where success is {:g} %", places.percent()),
      .note =
          "Median and 95 % interval of a model of success (a plane of log odds plus a Gaussian "
          "process; search/boundary_model.h). The grey band holds the whole boundary with 95 %: "
          "cells outside of it are together on the side that is shown. Trials were chosen near the "
          "boundary, a tenth of them evenly, so intervals far from it are wide; points of a "
          "cell stand side by side.",
      .wide = true};
  if (summary.envelopes.size() > 1) section.panels.push_back(TogetherOf(places, summary.envelopes));
  for (const EnvelopeDifference& difference : summary.differences)
    std::ranges::copy(DifferenceTexts(summary, difference), std::back_inserter(section.lines));
  for (const Envelope& envelope : summary.envelopes) {
    const std::string name = envelope.name.empty() ? "" : envelope.name + ": ";
    for (const Crossing& crossing : envelope.crossings) {
      const std::string text = CrossingText(summary, crossing);
      if (&crossing != &envelope.crossings.front() && (&crossing - 1)->range == crossing.range &&
          (&crossing - 1)->at == crossing.at)
        section.lines.back() += ", " + text.substr(text.find("% ") + 2);
      else
        section.lines.push_back(name + text);
    }
    for (const std::string& limit : envelope.limits) section.lines.push_back(name + limit);
    if (places.ranges() == 1) {
      section.panels.push_back(CurveOf(places, envelope));
      continue;
    }
    const int last = places.ranges() > 2 ? places.lattice().axes[2].values - 1 : 0;
    for (const int at : last > 0 ? std::vector{0, last / 2, last} : std::vector{0})
      section.panels.push_back(MapOf(places, envelope, at));
    for (size_t k = 0; k < places.ranges(); ++k) {
      report::Panel panel = RatePanel(places, k);
      AddRate(places, envelope, k, MiddleOf(places, k).first, report::CurveColor(0), "success",
              &panel);
      section.panels.push_back(std::move(panel));
    }
  }
  return section;
}

}  // namespace turbidock::batch
