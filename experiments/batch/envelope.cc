#include "experiments/batch/envelope.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "experiments/batch/batch_report.h"
#include "experiments/batch/summary.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/statistics/rank_sum.h"

namespace turbidock::batch {
namespace {

using search::Side;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Of the lattice: a cell and the values of the ranges there.
double ValueOn(const EnvelopePlan& plan, size_t range, double place) {
  const int last = plan.Search().lattice.axes[range].values - 1;
  return plan.ranges[range].At(place / last);
}

// Where a draw crosses along a line from its first cell, in cells; infinite where it does not.
double PlaceOn(const std::vector<float>& draw, int first, int step, int count, bool falls) {
  const double sign = falls ? 1 : -1;
  const auto at = [&](int i) {
    const int cell = first + i * step;
    return sign * static_cast<double>(draw[static_cast<size_t>(cell)]);
  };
  if (at(0) < 0) return -kInfinite;
  for (int i = 1; i < count; ++i)
    if (at(i) < 0) return i - 1 + at(i - 1) / (at(i - 1) - at(i));
  return kInfinite;
}

// A line of cells along a range, the others being at a cell's place.
struct Line {
  size_t range = 0;
  int first = 0, step = 1, count = 2;  // cells
  std::vector<double> at{};            // values of the ranges
};

Line LineAlong(const EnvelopePlan& plan, size_t range, std::vector<int> cell) {
  const search::Lattice lattice = plan.Search().lattice;
  Line line{.range = range, .step = lattice.Step(range), .count = lattice.axes[range].values};
  cell[range] = 0;
  for (size_t k = 0; k < cell.size(); ++k) {
    line.first += cell[k] * lattice.Step(k);
    line.at.push_back(ValueOn(plan, k, cell[k]));
  }
  return line;
}

// Between the cells `begin` and `end` of a line.
Crossing CrossingIn(const EnvelopePlan& plan, const search::Boundary& boundary, const Line& line,
                    int begin, int end, bool falls) {
  const auto value_at = [&](double place) { return ValueOn(plan, line.range, place); };
  Crossing crossing{.range = line.range,
                    .at = line.at,
                    .falls = falls,
                    .from = value_at(begin),
                    .to = value_at(end)};
  std::vector<double> places;
  for (const auto& draw : boundary.draws) {
    places.push_back(
        begin + PlaceOn(draw, line.first + begin * line.step, line.step, end - begin + 1, falls));
    crossing.drawn.push_back(value_at(std::clamp<double>(places.back(), begin, end)));
  }
  std::ranges::sort(places);
  const auto share = [&](double infinite) {
    return static_cast<double>(std::ranges::count(places, infinite)) /
           static_cast<double>(places.size());
  };
  const auto value = [&](double of) {
    const double place = places[static_cast<size_t>(of * static_cast<double>(places.size() - 1))];
    return std::isfinite(place) ? value_at(place) : place;
  };
  crossing.before = share(-kInfinite), crossing.beyond = share(kInfinite);
  crossing.value = value(0.5);
  crossing.low = value(0.025), crossing.high = value(0.975);
  if (crossing.from > crossing.to) std::swap(crossing.low, crossing.high);
  return crossing;
}

// One where success is known to fall or to rise, else as many as the medians have.
std::vector<Crossing> CrossingsAlong(const EnvelopePlan& plan, const search::Boundary& boundary,
                                     const Line& line) {
  const search::Trend trend = plan.ranges[line.range].success;
  const int last = line.count - 1;
  if (trend != search::Trend::kUnknown)
    return {CrossingIn(plan, boundary, line, 0, last, trend == search::Trend::kFalls)};
  const auto place = [&](int i) {
    const int cell = line.first + i * line.step;
    return static_cast<size_t>(cell);
  };
  std::vector<int> changes;
  for (int i = 1; i <= last; ++i)
    if ((boundary.above[place(i)] >= 0.5) != (boundary.above[place(i - 1)] >= 0.5))
      changes.push_back(i);
  if (changes.empty())
    return {CrossingIn(plan, boundary, line, 0, last,
                       boundary.rate[place(0)] >= boundary.rate[place(last)])};
  std::vector<Crossing> crossings;
  for (size_t i = 0; i < changes.size(); ++i) {
    const int begin = i == 0 ? 0 : (changes[i - 1] + changes[i]) / 2,
              end = i + 1 == changes.size() ? last : (changes[i] + changes[i + 1]) / 2;
    crossings.push_back(
        CrossingIn(plan, boundary, line, begin, end, boundary.above[place(changes[i] - 1)] >= 0.5));
  }
  return crossings;
}

// Of each draw, the share of the ranges in which success is above the rate.
std::vector<double> AreasOf(const search::Boundary& boundary) {
  std::vector<double> areas;
  for (const auto& draw : boundary.draws)
    areas.push_back(
        static_cast<double>(std::ranges::count_if(draw, [](float v) { return v >= 0; })) /
        static_cast<double>(draw.size()));
  return areas;
}

// Trials of the same place and seed.
std::vector<search::TrialPair> PairsOf(const Envelope& a, const Envelope& b, int points) {
  std::map<std::pair<int64_t, int64_t>, bool> of_a;  // by place and seed
  for (const StoredTrial* trial : a.shown)
    if (trial->record.judged())
      of_a[{trial->cell % points, trial->record.seed}] = trial->record.success();
  std::vector<search::TrialPair> pairs;
  for (const StoredTrial* trial : b.shown) {
    const auto found = of_a.find({trial->cell % points, trial->record.seed});
    if (found == of_a.end() || !trial->record.judged()) continue;
    pairs.push_back(
        {static_cast<int>(trial->cell % points), found->second, trial->record.success()});
  }
  return pairs;
}

EnvelopeDifference DifferenceTo(const EnvelopeSummary& summary, size_t envelope) {
  const Envelope &a = summary.envelopes[0], &b = summary.envelopes[envelope];
  const auto pairs = PairsOf(a, b, static_cast<int>(summary.plan.points()));
  EnvelopeDifference difference{.envelope = envelope, .pairs = std::ssize(pairs)};
  difference.area =
      DifferenceOf(a.boundary, AreasOf(a.boundary), b.boundary, AreasOf(b.boundary), pairs);
  const auto within = [](const Crossing& c) {
    return std::isfinite(c.low) && std::isfinite(c.high);
  };
  // That of a line with one crossing.
  const auto only = [](const Envelope& of, const Crossing& like) -> const Crossing* {
    const auto is_like = [&](const Crossing& c) {
      return c.range == like.range && c.at == like.at;
    };
    const auto found = std::ranges::find_if(of.crossings, is_like);
    return std::ranges::count_if(of.crossings, is_like) == 1 ? &*found : nullptr;
  };
  for (size_t i = 0; i < a.crossings.size(); ++i) {
    const Crossing &of_a = a.crossings[i], *of_b = only(b, of_a);
    if (only(a, of_a) && of_b && within(of_a) && within(*of_b) && of_a.falls == of_b->falls)
      difference.crossings.emplace_back(
          i, DifferenceOf(a.boundary, of_a.drawn, b.boundary, of_b->drawn, pairs));
  }
  return difference;
}

// In how many separate regions the cells that are no `other` hold one that is `side`.
int RegionsOf(const search::Lattice& lattice, const std::vector<Side>& sides, Side side,
              Side other) {
  std::vector<bool> seen(sides.size());
  int regions = 0;
  for (int start = 0; start < lattice.cells(); ++start) {
    if (seen[static_cast<size_t>(start)] || sides[static_cast<size_t>(start)] == other) continue;
    bool has_side = false;
    std::vector<int> open = {start};
    seen[static_cast<size_t>(start)] = true;
    while (!open.empty()) {
      const int cell = open.back();
      open.pop_back();
      has_side |= sides[static_cast<size_t>(cell)] == side;
      const std::vector<int> at = lattice.At(cell);
      for (size_t k = 0; k < at.size(); ++k)
        for (const int way : {-1, 1}) {
          if (at[k] + way < 0 || at[k] + way >= lattice.axes[k].values) continue;
          const int next = cell + way * lattice.Step(k);
          if (seen[static_cast<size_t>(next)] || sides[static_cast<size_t>(next)] == other)
            continue;
          seen[static_cast<size_t>(next)] = true;
          open.push_back(next);
        }
    }
    regions += has_side;
  }
  return regions;
}

// Averaged over the cells within a tenth of each range: of single cells some are against by chance.
std::vector<float> Smoothed(const search::Lattice& lattice, std::vector<float> draw) {
  constexpr double kReach = 0.1;
  for (size_t k = 0; k < lattice.axes.size(); ++k) {
    const std::vector<float> from = draw;
    const int count = lattice.axes[k].values, step = lattice.Step(k);
    const auto reach = static_cast<int>(std::lround(kReach * (count - 1)));
    for (int cell = 0; cell < lattice.cells(); ++cell) {
      const int at = cell / step % count;
      const int first = std::max(-reach, -at), last = std::min(reach, count - 1 - at);
      float sum = 0;
      for (int i = first; i <= last; ++i) {
        const int neighbour = cell + i * step;
        sum += from[static_cast<size_t>(neighbour)];
      }
      draw[static_cast<size_t>(cell)] = sum / static_cast<float>(last - first + 1);
    }
  }
  return draw;
}

// Whether later cells of a line along a range are higher where they should be lower, or the other
// way round, in nearly all draws.
bool IsAgainst(const search::Boundary& free, const search::Lattice& lattice, size_t range) {
  constexpr float kLeast = 0.5;  // of log odds
  constexpr double kShare = 0.98;
  const float sign = lattice.axes[range].trend == search::Trend::kFalls ? 1 : -1;
  const int step = lattice.Step(range), count = lattice.axes[range].values;
  for (int cell = 0; cell < lattice.cells(); ++cell)
    for (int ahead = 1; ahead < count - lattice.At(cell)[range]; ++ahead) {
      const int later = cell + ahead * step;
      const auto at = static_cast<size_t>(cell), then = static_cast<size_t>(later);
      const auto against = std::ranges::count_if(
          free.draws, [&](const auto& draw) { return sign * (draw[then] - draw[at]) > kLeast; });
      if (static_cast<double>(against) >= kShare * static_cast<double>(free.draws.size()))
        return true;
    }
  return false;
}

// Whether the first round, which knew of no result and covers the ranges evenly, says the opposite.
bool IsOpposite(const search::BoundarySearch& search, const std::vector<const StoredTrial*>& trials,
                size_t range) {
  constexpr double kFarthest = 2.6;  // one in 200 where success does not change
  const auto cells = static_cast<size_t>(search.lattice.cells());
  const std::vector<int> first =
      NextRound(search, std::vector<search::Tally>(cells), std::vector<int64_t>(cells));
  std::array<std::vector<double>, 2> places;
  for (const StoredTrial* trial : trials) {
    const auto cell = static_cast<int>(trial->cell % search.lattice.cells());
    if (trial->sample == 0 && trial->record.judged() && std::ranges::count(first, cell) > 0)
      places[trial->record.success()].push_back(search.lattice.At(cell)[range]);
  }
  const double z = statistics::RankSumZ(places[1], places[0]);
  return search.lattice.axes[range].trend == search::Trend::kFalls ? z > kFarthest : z < -kFarthest;
}

// The ranges along which success does not do as the plan says, as far as trials show without it.
std::vector<std::string> NotMonotone(const EnvelopePlan& plan, const Envelope& envelope,
                                     const std::vector<search::Tally>& tallies) {
  std::vector<std::string> keys;
  search::BoundarySearch free = plan.Search();
  const search::Lattice lattice = free.lattice;
  for (search::LatticeAxis& axis : free.lattice.axes) axis.trend = search::Trend::kUnknown;
  search::Boundary boundary = BoundaryOf(free, tallies);
  for (auto& draw : boundary.draws) draw = Smoothed(lattice, std::move(draw));
  for (size_t k = 0; k < lattice.axes.size(); ++k)
    if (lattice.axes[k].trend != search::Trend::kUnknown &&
        (IsAgainst(boundary, lattice, k) || IsOpposite(plan.Search(), envelope.shown, k)))
      keys.push_back(NameOfKey(plan.ranges[k].key).label);
  return keys;
}

bool HasEnded(const Envelope& envelope) {
  return std::ranges::any_of(envelope.shown, [](const auto* t) { return t->record.ended(); });
}

std::vector<std::string> LimitsOf(const EnvelopePlan& plan, const Envelope& envelope,
                                  const std::vector<search::Tally>& tallies) {
  std::vector<std::string> limits;
  const search::BoundarySearch search = plan.Search();
  const std::vector<Side>& sides = envelope.boundary.sides;
  const double percent = 100 * search.rate;
  if (!HasEnded(envelope)) return {"Every trial crashed or hung: this says nothing of docking."};
  if (std::ranges::count(sides, Side::kBelow) == 0)
    limits.push_back(fmt::format(
        "Nowhere in the ranges is success shown to be below {:g} %: the boundary may be outside.",
        percent));
  if (std::ranges::count(sides, Side::kAbove) == 0)
    limits.push_back(fmt::format(
        "Nowhere in the ranges is success shown to be above {:g} %: the boundary may be outside.",
        percent));
  if (!envelope.reached)
    limits.push_back(fmt::format("{:.0f} % of the ranges is undecided; {:.0f} % was asked for.",
                                 100 * envelope.boundary.undecided, 100 * search.width));
  if (const auto keys = NotMonotone(plan, envelope, tallies); !keys.empty())
    limits.push_back(fmt::format(
        "Success is not monotone in {}, although the plan says so: leave `success` out there.",
        fmt::join(keys, ", ")));
  for (const auto& [side, other, word] :
       {std::tuple{Side::kBelow, Side::kAbove, "below"}, {Side::kAbove, Side::kBelow, "above"}})
    if (const int regions = RegionsOf(search.lattice, sides, side, other); regions > 1)
      limits.push_back(fmt::format(
          "Success is {} {:g} % in {} separate regions: see the picture, not the words.", word,
          percent, regions));
  return limits;
}

// " at gust std 0.1 m/s", of the ranges that are not crossed along.
std::string WhereText(const EnvelopeSummary& summary, const Crossing& crossing) {
  std::vector<std::string> others;
  for (size_t k = 0; k < crossing.at.size(); ++k) {
    if (k == crossing.range) continue;
    const report::Quantity of = NameOfKey(summary.plan.ranges[k].key);
    others.push_back(of.label + " " + of.Text(report::Digits(of.factor * crossing.at[k])));
  }
  return others.empty() ? "" : fmt::format(" at {}", fmt::join(others, ", "));
}

}  // namespace

Envelope EnvelopeOf(const EnvelopePlan& plan, std::string name,
                    std::vector<const StoredTrial*> trials) {
  Envelope envelope{.name = std::move(name), .shown = std::move(trials)};
  const search::BoundarySearch search = plan.Search();
  const int points = search.lattice.cells();
  std::vector<search::Tally> tallies(static_cast<size_t>(points));
  for (const StoredTrial* trial : envelope.shown) {
    if (!trial->record.judged()) continue;
    search::Tally& tally = tallies[static_cast<size_t>(trial->cell % points)];
    ++tally.trials, ++envelope.trials;
    tally.successes += trial->record.success();
  }
  envelope.boundary = BoundaryOf(search, tallies);
  if (!HasEnded(envelope)) {
    std::ranges::fill(envelope.boundary.sides, Side::kUndecided);
    envelope.boundary.undecided = 1;
  }
  envelope.reached = HasEnded(envelope) && envelope.boundary.undecided <= search.width;
  const size_t ranges = plan.ranges.size();
  for (size_t k = 0; k < ranges && HasEnded(envelope); ++k)
    for (const double share : {0.0, 0.5, 1.0}) {
      std::vector<int> cell;
      for (const search::LatticeAxis& axis : search.lattice.axes)
        cell.push_back(static_cast<int>(std::lround(share * (axis.values - 1))));
      std::ranges::move(CrossingsAlong(plan, envelope.boundary, LineAlong(plan, k, cell)),
                        std::back_inserter(envelope.crossings));
      if (ranges == 1) break;
    }
  envelope.limits = LimitsOf(plan, envelope, tallies);
  std::vector<double> areas = AreasOf(envelope.boundary);
  std::ranges::sort(areas);
  const auto at = [&](double share) {
    return areas[static_cast<size_t>(share * static_cast<double>(areas.size() - 1))];
  };
  envelope.area = {at(0.5), at(0.025), at(0.975)};
  return envelope;
}

std::optional<EnvelopeSummary> EnvelopesOf(const StoreHeader& header,
                                           const std::vector<StoredTrial>& trials) {
  if (header.kind != "batch") return std::nullopt;
  auto plan = ReadEnvelope(config::ParseYaml(header.plan, "plan"));
  if (!plan) return std::nullopt;
  EnvelopeSummary summary{.plan = *std::move(plan)};
  const int64_t points = summary.plan.points();
  std::map<int64_t, std::vector<const StoredTrial*>> by_envelope;
  for (const StoredTrial& trial : trials) by_envelope[trial.cell / points].push_back(&trial);
  for (auto& [number, shown] : by_envelope) {
    std::vector<std::string> names;
    for (size_t i = 0; i < GridOf(header).size(); ++i) {
      const Parameter& parameter = shown.front()->parameters[i];
      names.push_back(ValueText(parameter.key, parameter.value));
    }
    summary.envelopes.push_back(
        EnvelopeOf(summary.plan, fmt::format("{}", fmt::join(names, ", ")), std::move(shown)));
  }
  for (size_t i = 1; i < summary.envelopes.size(); ++i)
    if (HasEnded(summary.envelopes[0]) && HasEnded(summary.envelopes[i]))
      summary.differences.push_back(DifferenceTo(summary, i));
  return summary;
}

std::string CrossingText(const EnvelopeSummary& summary, const Crossing& crossing) {
  const RangeKey& range = summary.plan.ranges[crossing.range];
  const report::Quantity name = NameOfKey(range.key);
  const double percent = 100 * summary.plan.find.rate;
  const std::string where = WhereText(summary, crossing);
  if (std::isinf(crossing.low) && crossing.low == crossing.high) {
    const bool above = (crossing.low > 0) == crossing.falls;
    return fmt::format("{} {:g} % at every {}{}", above ? "above" : "below", percent, name.label,
                       where);
  }
  const auto text = [&](double value) {
    return std::isfinite(value) ? report::Digits(name.factor * value, 3)
           : value < 0          ? "before " + report::Digits(name.factor * crossing.from, 3)
                                : "beyond " + report::Digits(name.factor * crossing.to, 3);
  };
  return fmt::format("{:g} % {} {} {}{}", percent, crossing.falls ? "up to" : "from", name.label,
                     name.Text(fmt::format("{} [{}, {}]", text(crossing.value), text(crossing.low),
                                           text(crossing.high))),
                     where);
}

std::vector<std::string> DifferenceTexts(const EnvelopeSummary& summary,
                                         const EnvelopeDifference& difference) {
  const auto text = [](const search::Difference& d, double factor) {
    const auto number = [&](double v) {
      return (v > 0 ? "+" : "") + report::Digits(factor * v, 3);
    };
    return fmt::format("{} [{}, {}]", number(d.value), number(d.low), number(d.high));
  };
  const Envelope& first = summary.envelopes[0];
  const std::string names =
      fmt::format("{} less {}: ", summary.envelopes[difference.envelope].name, first.name);
  const double percent = 100 * summary.plan.find.rate;
  std::vector<std::string> lines = {fmt::format(
      "{}above {:g} % in {} % of the ranges ({} pairs of a seed, correlation {:.2f})", names,
      percent, text(difference.area, 100), difference.pairs, difference.area.correlation)};
  for (const auto& [of, d] : difference.crossings) {
    const Crossing& crossing = first.crossings[of];
    const report::Quantity name = NameOfKey(summary.plan.ranges[crossing.range].key);
    lines.push_back(fmt::format("{}the {:g} % boundary in {} is moved by {}{}", names, percent,
                                name.label, name.Text(text(d, name.factor)),
                                WhereText(summary, crossing)));
  }
  return lines;
}

report::Json EnvelopeJson(const EnvelopeSummary& summary) {
  using report::Json;
  const EnvelopePlan& plan = summary.plan;
  Json ranges = Json::array(), envelopes = Json::array(), differences = Json::array();
  for (size_t k = 0; k < plan.ranges.size(); ++k) {
    const RangeKey& range = plan.ranges[k];
    std::vector<double> values;
    for (int i = 0; i < plan.Search().lattice.axes[k].values; ++i)
      values.push_back(ValueOn(plan, k, i));
    ranges.push_back({{"key", range.key}, {"success", NameOf(range.success)}, {"values", values}});
  }
  const auto numbers = [](const search::Estimate& of) {
    return Json{{"value", of.value}, {"low", of.low}, {"high", of.high}};
  };
  const auto number = [](double value) { return std::isfinite(value) ? Json(value) : Json(); };
  const auto others = [&](const Crossing& crossing) {
    Json at = Json::object();
    for (size_t k = 0; k < plan.ranges.size(); ++k)
      if (k != crossing.range) at[plan.ranges[k].key] = crossing.at[k];
    return at;
  };
  for (const Envelope& envelope : summary.envelopes) {
    Json crossings = Json::array();
    for (const Crossing& crossing : envelope.crossings)
      crossings.push_back({{"key", plan.ranges[crossing.range].key},
                           {"at", others(crossing)},
                           {"falls", crossing.falls},
                           {"value", number(crossing.value)},
                           {"low", number(crossing.low)},
                           {"high", number(crossing.high)},
                           {"before", crossing.before},
                           {"beyond", crossing.beyond},
                           {"text", CrossingText(summary, crossing)}});
    std::vector<int> sides;
    for (const Side side : envelope.boundary.sides) sides.push_back(static_cast<int>(side));
    envelopes.push_back({{"name", envelope.name},
                         {"trials", envelope.trials},
                         {"undecided", envelope.boundary.undecided},
                         {"reached", envelope.reached},
                         {"area", HasEnded(envelope) ? numbers(envelope.area) : Json()},
                         {"crossings", crossings},
                         {"limits", envelope.limits},
                         {"sides", sides},
                         {"rate", envelope.boundary.rate},
                         {"low", envelope.boundary.low},
                         {"high", envelope.boundary.high}});
  }
  for (const EnvelopeDifference& difference : summary.differences) {
    Json crossings = Json::array();
    for (const auto& [of, d] : difference.crossings) {
      const Crossing& crossing = summary.envelopes[0].crossings[of];
      crossings.push_back(numbers(d));
      crossings.back().update({{"key", plan.ranges[crossing.range].key}, {"at", others(crossing)}});
    }
    differences.push_back({{"of", summary.envelopes[difference.envelope].name},
                           {"less", summary.envelopes[0].name},
                           {"pairs", difference.pairs},
                           {"correlation", difference.area.correlation},
                           {"area", numbers(difference.area)},
                           {"crossings", crossings}});
  }
  return {{"rate", plan.find.rate},
          {"width", plan.find.width},
          {"ranges", ranges},
          {"envelopes", envelopes},
          {"differences", differences}};
}

}  // namespace turbidock::batch
