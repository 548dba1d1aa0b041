#include "experiments/studies/gate/gate_design.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <optional>

#include "experiments/config/yaml_node.h"
#include "experiments/farm/result_store.h"
#include "experiments/report/table.h"
#include "experiments/statistics/intervals.h"
#include "experiments/statistics/sequential_test.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/studies/gate/gate_size.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

namespace fs = std::filesystem;
using report::Fixed;
using statistics::PairedRateTest;

// A candidate is at the edge when so many dock.
constexpr double kEdgeLow = 0.8, kEdgeHigh = 0.975;
// The easy condition is for what breaks docking altogether: the margin that such a gate has.
constexpr double kEasyMargin = 0.2;
constexpr double kHarmless = 0.99;  // of builds that only differ pass each median's test
constexpr double kAlike = 0.01;     // powers closer than this are one: no rate is known so well
constexpr int kTestsOfCondition = 1 + static_cast<int>(kMedianMeasures.size());

// No less, however alike the trials are: what nobody minds.
constexpr Quality kLeastMargins{.time_s = 0.5,
                                .final_error_m = 0.001,
                                .returns_to_servoing = 1,
                                .fitness = 0.01,
                                .effort_v = 0.02};

double Phi(double z) { return boost::math::cdf(boost::math::normal(), z); }
double Probit(double p) { return boost::math::quantile(boost::math::normal(), p); }

double ShiftOf(const DesignOptions& options, double to) {
  return Probit(options.from) - Probit(to);
}

double After(double rate, double shift) { return Phi(Probit(rate) - shift); }

// Of one test, where all tests of so many conditions share the gate's.
double AlphaOf(const DesignOptions& options, int conditions) {
  return options.alpha / (kTestsOfCondition * conditions);
}

// Two digits, for people: what is lost, rounded down, and 0.01 at least.
double ReadableMargin(double lost) { return std::max(0.01, std::floor(100 * lost) / 100); }

// The least margin with which a build passes whose trials have nothing to do with the baseline's
// (a compiler that sums otherwise makes other trials of the same seeds), kHarmless of the time and
// by the last trial. Two digits that count, at least `least`.
double MedianMargin(const std::vector<double>& values, double least, double beta, int trials) {
  if (values.size() < 2) return 0;
  const statistics::HitTest test = statistics::SignTest(beta, trials);
  double low = 0.5, high = 1;
  for (int i = 0; i < 40; ++i) {
    const double share = (low + high) / 2;
    (test.RejectionRate(share) >= kHarmless ? high : low) = share;
  }
  std::vector<double> differences;
  for (const double a : values)
    for (const double b : values)
      if (&a != &b) differences.push_back(a - b);
  const double margin = std::max(least, *statistics::Quantile(std::move(differences), high));
  const double unit = std::pow(10, std::floor(std::log10(margin)) - 1);
  return std::ceil(margin / unit - 1e-9) * unit;
}

DesignedCondition Designed(const Candidate& candidate, const DesignOptions& options, int conditions,
                           bool easy) {
  const double alpha = AlphaOf(options, conditions);
  DesignedCondition designed{.name = candidate.name, .rate = candidate.rate(), .easy = easy};
  designed.lost_rate = After(designed.rate, ShiftOf(options, options.to));
  const double lost = designed.rate - designed.lost_rate;
  designed.margins.success_rate = easy ? kEasyMargin : ReadableMargin(lost);
  const int most = TrialsToDecide(designed.margins.success_rate, alpha, options.beta,
                                  easy ? 0 : lost, options.most_trials);
  const PairedRateTest test(designed.margins.success_rate, alpha, options.beta, most);
  designed.max_trials = most;
  designed.unchanged_trials = std::min(test.FewestPairs(), most);
  designed.unchanged_s = designed.unchanged_trials * candidate.trial_s;
  designed.power = test.At(lost).p_fail;
  for (const MedianMeasure& measure : kMedianMeasures) {
    std::vector<double> values;
    for (const Quality& quality : candidate.docked_well)
      if (std::isfinite(quality.*measure.value)) values.push_back(quality.*measure.value);
    designed.margins.median.*measure.value =
        MedianMargin(values, kLeastMargins.*measure.value, options.beta, most);
  }
  return designed;
}

// That a gate of so many conditions fails by one of these when a loss takes options.from to `to`.
double PowerOf(const std::vector<DesignedCondition>& some, const DesignOptions& options,
               int conditions, double to) {
  const double alpha = AlphaOf(options, conditions);
  double none = 1;
  for (const DesignedCondition& c : some) {
    const PairedRateTest test(c.margins.success_rate, alpha, options.beta, c.max_trials);
    none *= 1 - test.At(c.rate - After(c.rate, ShiftOf(options, to))).p_fail;
  }
  return 1 - none;
}

bool IsEdge(const Candidate& c) { return kEdgeLow <= c.rate() && c.rate() <= kEdgeHigh; }

// The same keys, whatever their values.
bool SameKind(const Candidate& a, const Candidate& b) {
  return std::ranges::equal(a.settings, b.settings, {}, &farm::Parameter::key,
                            &farm::Parameter::key);
}

struct Offer {
  const Candidate* candidate;
  DesignedCondition condition;
};

// Of a kind that nothing taken is of, where there is one: what a regression does to one of a kind
// it does to the others. Then the strongest, and of those that are alike the cheapest.
Offer BestOf(const std::vector<Offer>& offers, const std::vector<const Candidate*>& taken) {
  const auto is_new = [&](const Offer& offer) {
    return std::ranges::none_of(
        taken, [&](const Candidate* other) { return SameKind(*offer.candidate, *other); });
  };
  std::vector<Offer> some;
  std::ranges::copy_if(offers, std::back_inserter(some), is_new);
  if (some.empty()) some = offers;
  const auto power = [](const Offer& offer) { return offer.condition.power; };
  const double strongest = power(std::ranges::max(some, {}, power));
  std::erase_if(some, [&](const Offer& offer) { return power(offer) < strongest - kAlike; });
  return std::ranges::min(some, {}, [](const Offer& offer) { return offer.condition.unchanged_s; });
}

std::string Share(double share) { return fmt::format("{:.1f} %", 100 * share); }

std::string ShownName(const DesignedCondition& c) { return c.name + (c.easy ? " (easy)" : ""); }

// The scenario of a cell's trials, without their seeds.
std::string CellText(const farm::Plan& plan, int64_t cell) {
  trial::Scenario scenario = plan.ScenarioOf(plan.FirstOf(cell));
  scenario.seed = 0;
  return trial::SaveScenario(scenario);
}

void RequireSameCells(const farm::Plan& plan, const farm::ResultStore& results,
                      const std::string& file) {
  const farm::Plan flown(results.header().plan, file + " (its plan)", {.plugins = plan.plugins()});
  const std::string other = file + ": the results are of another plan: theirs ";
  if (flown.keys() != plan.keys() || flown.cells() != plan.cells())
    throw ConfigError(other + "has other keys or another number of cells");
  for (int64_t cell = 0; cell < plan.cells(); ++cell)
    if (CellText(flown, cell) != CellText(plan, cell))
      throw ConfigError(other + "differs in " + plan.CellOf(cell).name);
}

// What a trial took, processor time if that is known.
std::optional<double> SecondsOf(const trial::TrialRecord& record) {
  for (const double seconds : {record.cpu_time_s, record.wall_time_s})
    if (std::isfinite(seconds) && seconds > 0) return seconds;
  return std::nullopt;
}

// A condition's `set`; of a key that is given twice, by a plan and a command line, the last.
config::YamlNode SetOf(const std::vector<farm::Parameter>& settings) {
  const config::YamlNode nothing = config::ParseYaml("{}", "set");
  config::YamlNode set = nothing;
  for (const farm::Parameter& p : settings) {
    const config::YamlNode value = config::ParseYamlValue(p.value, {nullptr, "set", p.key});
    set = set.With(ValuesBelow(nothing.With({{p.key, value}})));
  }
  return set;
}

}  // namespace

std::vector<Candidate> CandidatesOf(const farm::Plan& plan, const std::string& file) {
  const farm::ResultStore results = farm::ResultStore::Read(file);
  RequireSameCells(plan, results, file);
  const auto fail = [&file](const std::string& why) { throw ConfigError(file + ": " + why); };
  std::vector<Candidate> candidates(static_cast<size_t>(plan.cells()));
  for (int64_t cell = 0; cell < plan.cells(); ++cell) {
    const farm::Plan::Cell of = plan.CellOf(cell);
    Candidate& candidate = candidates[static_cast<size_t>(cell)];
    candidate.name = of.name.empty() ? of.scenario : of.name;
    candidate.scenario = of.scenario;
    candidate.settings = of.values;
  }
  if (plan.keys().size() != plan.grid().size())
    throw ConfigError(plan.keys()[plan.grid().size()] +
                      ": is drawn for each trial; a gate's conditions are fixed");
  std::vector<std::vector<double>> seconds(candidates.size());
  for (const farm::StoredTrial& trial : results.Trials()) {
    if (!trial.record.ended()) continue;
    if (trial.cell < 0 || trial.cell >= plan.cells())
      fail(fmt::format("is damaged: trial {} is of cell {}, must be in [0, {}]", trial.trial,
                       trial.cell, plan.cells() - 1));
    const auto cell = static_cast<size_t>(trial.cell);
    Candidate& candidate = candidates[cell];
    ++candidate.trials;
    candidate.docked += trial.record.outcome == trial::Outcome::kDocked;
    if (const auto took = SecondsOf(trial.record)) seconds[cell].push_back(*took);
    if (trial.record.outcome != trial::Outcome::kDocked) continue;
    candidate.docked_well.push_back(QualityOf(trial.record));
  }
  for (size_t i = 0; i < candidates.size(); ++i) {
    if (candidates[i].trials == 0)
      fail(candidates[i].name + ": has no trials yet; finish the batch");
    if (seconds[i].empty()) fail(candidates[i].name + ": no trial of it says how long it took");
    candidates[i].trial_s = *statistics::Median(seconds[i]);
  }
  return candidates;
}

GateDesign DesignGate(const std::vector<Candidate>& candidates, const DesignOptions& options) {
  TD_CHECK(!candidates.empty(), "a gate is chosen from candidates");
  const auto rate = [](const Candidate& c) { return -c.rate(); };
  const Candidate& easiest = *std::ranges::min_element(candidates, {}, rate);  // the first of them
  GateDesign design{.options = options, .candidates = {}, .chosen = {}};
  for (const Candidate& candidate : candidates)
    design.candidates.push_back(Designed(candidate, options, 2, false));

  std::vector<const Candidate*> edge;
  for (const Candidate& candidate : candidates)
    if (IsEdge(candidate)) edge.push_back(&candidate);
  if (edge.empty()) {
    std::string rates;
    for (const Candidate& c : candidates)
      rates += fmt::format("{}{}: {} of {}", rates.empty() ? "" : ", ", c.name, c.docked, c.trials);
    throw ConfigError(fmt::format(
        "no candidate is at the edge, where {:.0f} to {:.0f} % dock and a loss shows: {}",
        100 * kEdgeLow, 100 * kEdgeHigh, rates));
  }

  // Where the easiest is at the edge nothing is easy: there is none beside the others.
  const int beside = IsEdge(easiest) ? 0 : 1;
  // Each number of conditions shares alpha its own way.
  const double workers = options.workers;
  double least_s = std::numeric_limits<double>::infinity();
  for (int many = 1; many + beside <= kMostConditions; ++many) {
    std::vector<DesignedCondition> chosen, easy;
    if (beside) easy.push_back(Designed(easiest, options, many + beside, true));
    double seconds = easy.empty() ? 0 : easy[0].unchanged_s / workers;
    std::vector<const Candidate*> left = edge, taken;
    while (static_cast<int>(chosen.size()) < many && !left.empty()) {
      std::vector<Offer> offers;
      for (const Candidate* candidate : left) {
        Offer offer{candidate, Designed(*candidate, options, many + beside, false)};
        const double with_it_s = seconds + offer.condition.unchanged_s / workers;
        if (chosen.empty()) least_s = std::min(least_s, with_it_s);
        if (with_it_s <= options.budget_s) offers.push_back(std::move(offer));
      }
      if (offers.empty()) break;
      const Offer best = BestOf(offers, taken);
      seconds += best.condition.unchanged_s / workers;
      chosen.push_back(best.condition);
      taken.push_back(best.candidate);
      std::erase(left, best.candidate);
    }
    if (static_cast<int>(chosen.size()) < many) break;
    chosen.insert(chosen.end(), easy.begin(), easy.end());
    const double power = PowerOf(chosen, options, many + beside, options.to);
    if (power <= design.power) continue;
    design.chosen = chosen;
    design.unchanged_s = seconds;
    design.power = power;
  }
  if (design.chosen.empty())
    throw ConfigError(
        fmt::format("a budget of {:g} s is too small: the cheapest gate with a condition at the "
                    "edge takes {:.0f} s",
                    options.budget_s, std::ceil(least_s)));
  return design;
}

std::string GateYaml(const GateDesign& design, const std::vector<Candidate>& candidates,
                     const std::string& baseline, const std::string& folder) {
  const DesignOptions& options = design.options;
  const auto quoted = [](const std::string& word) { return config::TextNode(word, {}).OneLine(); };
  std::string text = fmt::format(
      "# Chosen by `turbidock gate --design` to notice what takes a success rate of {:g} to {:g}: "
      "power {:.2f},\n"
      "# {:.0f} s by {} workers for a build without change.\n"
      "schema_version: 1\ndescription: designed to notice a loss\nbaseline: {}\nalpha: {:g}\n"
      "beta: {:g}\nconditions:\n",
      options.from, options.to, design.power, design.unchanged_s, options.workers, quoted(baseline),
      options.alpha, options.beta);
  for (const DesignedCondition& c : design.chosen) {
    const Candidate& candidate = *std::ranges::find(candidates, c.name, &Candidate::name);
    std::string scenario = candidate.scenario;
    if (std::error_code ignored; fs::is_regular_file(scenario, ignored))
      scenario = fs::relative(scenario, folder.empty() ? "." : folder).string();
    text += fmt::format("  - name: {}\n    scenario: {}\n", quoted(c.name), quoted(scenario));
    const config::YamlNode set = SetOf(candidate.settings);
    if (!set.Entries().empty()) text += "    set: " + set.OneLine() + "\n";
    std::vector<std::string> margins;
    GateMargins::Fields(c.margins, [&](const char* key, double margin, auto&&...) {
      margins.push_back(fmt::format("{}: {:g}", key, margin));
    });
    text += fmt::format("    max_trials: {}\n    margins: {{{}}}\n", c.max_trials,
                        fmt::join(margins, ", "));
  }
  return text;
}

namespace {

report::Table TableOf(const std::vector<DesignedCondition>& conditions) {
  report::Table table({"<condition", "docks", "after", "margin", "s", "mm", "returns", "F", "V",
                       "trials", "at most", "CPU s", "power"});
  for (const DesignedCondition& c : conditions) {
    const Quality& m = c.margins.median;
    table.Row({ShownName(c), Share(c.rate), Share(c.lost_rate),
               fmt::format("{:.2f}", c.margins.success_rate), fmt::format("{:g}", m.time_s),
               fmt::format("{:g}", 1000 * m.final_error_m),
               fmt::format("{:g}", m.returns_to_servoing), fmt::format("{:g}", m.fitness),
               fmt::format("{:g}", m.effort_v), std::to_string(c.unchanged_trials),
               std::to_string(c.max_trials), Fixed(c.unchanged_s, 0), Fixed(c.power, 3)});
  }
  return table;
}

// Power over the loss: of the chosen conditions together, and of each alone.
report::Panel PowerPanel(const GateDesign& design) {
  const DesignOptions& options = design.options;
  const double least = std::max(0.02, options.from - 3 * (options.from - options.to));
  report::Panel panel{.x = {fmt::format("what is left of a success rate of {:g}", options.from),
                            least, options.from},
                      .y = {"probability that the gate fails", 0, 1},
                      .rules = {{.at = options.to, .is_up = true}}};
  const int of_all = static_cast<int>(std::ssize(design.chosen));  // which share alpha
  const auto draw = [&](const std::string& name, const std::vector<DesignedCondition>& conditions,
                        const Rgb& color) {
    std::vector<report::Sample> samples;
    for (const double to : report::Evenly(least, options.from - 1e-6, 60))
      samples.push_back({to, PowerOf(conditions, options, of_all, to)});
    panel.series.push_back({name, samples, color});
  };
  draw("the gate", design.chosen, {0, 0, 0});
  size_t edge = 0;
  for (const DesignedCondition& c : design.chosen)
    draw(ShownName(c), {c}, c.easy ? report::kGrey : report::CurveColor(edge++));
  return panel;
}

}  // namespace

report::Report ReportOf(const GateDesign& design) {
  const DesignOptions& options = design.options;
  return {
      .kind = "gate_design",
      .title = fmt::format("a gate that notices a success rate of {:g} falling to {:g}",
                           options.from, options.to),
      .facts = {{"power", Fixed(design.power, 3), "probability that it fails after that loss"},
                {"time", fmt::format("{:.0f} s", design.unchanged_s),
                 fmt::format("of a build without change by {} workers; {:g} s allowed",
                             options.workers, options.budget_s)},
                {"alpha", fmt::format("{:g}", options.alpha), "of the gate"},
                {"beta", fmt::format("{:g}", options.beta), "of each test"}},
      .sections = {
          {.title = "Chosen",
           .note = "After: the loss, as large everywhere in the probit of the rate. Margins of the "
                   "success rate, time to dock, true error, returns to servoing, F, effort. Trials "
                   "and CPU time: of a build without change.",
           .table = TableOf(design.chosen)},
          {.title = "Candidates",
           .note = "Each beside one other condition.",
           .table = TableOf(design.candidates)},
          {.title = "Power over the loss", .panels = {PowerPanel(design)}, .wide = true}}};
}

}  // namespace turbidock::gate
