// What a study leaves: its report, in numbers too, and the gains file.

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "experiments/batch/summary.h"
#include "experiments/report/table.h"
#include "experiments/studies/tuning/tuner.h"
#include "experiments/system/build_info.h"

namespace turbidock::tuning {
namespace {

using report::Json;
using report::Mark;

// The gains by their keys.
Json Named(const Study& study, const std::vector<double>& gains) {
  Json json = Json::object();
  for (size_t i = 0; i < gains.size(); ++i) json[study.settings().gains[i].key] = gains[i];
  return json;
}

std::string Difference(const statistics::PairedComparison& c) {
  return fmt::format("{:+.2f} [{:+.2f}, {:+.2f}]", c.mean, c.confidence.low, c.confidence.high);
}

// A cost that differs for sure.
report::Tone ToneOf(const statistics::PairedComparison& cost) {
  if (cost.confidence.high < 0) return report::Tone::kGood;
  return cost.confidence.low > 0 ? report::Tone::kBad : report::Tone::kNone;
}

report::Verdict VerdictOf(const Study& study, const TuningResult& result) {
  const int wanted = study.settings().optimiser.generations;
  if (!result.finished)
    return {"not finished", report::Tone::kNone,
            result.search_generations() < wanted
                ? fmt::format("{} of {} generations are done.", result.search_generations(), wanted)
                : "The search is done; what it found is being compared on held-out seeds."};
  const statistics::PairedComparison& cost = result.held_out->cost_difference;
  const std::string reason = fmt::format(
      "On {} held-out seeds the cost of a trial changes by {} from the start, p = {} (t).{}",
      cost.seeds, Difference(cost), report::PValue(cost.t_p),
      cost.mean >= 0 ? " The start is no worse: there is no reason to take the tuned gains." : "");
  const report::Tone tone = ToneOf(cost);
  if (tone == report::Tone::kGood) return {"better on held-out seeds", tone, reason};
  if (tone == report::Tone::kBad) return {"worse on held-out seeds", tone, reason};
  return {"no significant difference", tone, reason};
}

std::vector<report::Fact> FactsOf(const Study& study, const TuningResult& result) {
  const search::OptimiserParams& optimiser = study.settings().optimiser;
  const int done = result.search_generations();
  return {{"gains", std::to_string(result.start.size())},
          {"trials", std::to_string(result.trials)},
          {"generations",
           result.finished ? std::to_string(done)
                           : fmt::format("{} of {}", done, optimiser.generations),
           fmt::format("of {} candidates, after the start", optimiser.population)},
          {"study", study.hash(), "digest of all that decides its trials"}};
}

report::Section HeldOutSection(const TuningSettings& settings, const HeldOut& held_out) {
  report::Section section = batch::ChangeSection(held_out.changes, {.a = "before", .b = "tuned"});
  section.title = fmt::format("Before and after, on held-out seeds{}",
                              settings.proof.cameras ? ", through the cameras" : "");
  return section;
}

// Logarithmic where the costs differ much: a start or a candidate that is far worse squeezes
// nothing.
report::Axis CostAxis(const std::string& label, const std::vector<double>& costs) {
  if (costs.empty()) return {.label = label};
  const auto [low, high] = std::ranges::minmax(costs);
  return {.label = label, .logarithmic = low > 0 && high > 10 * low};
}

report::Section ConvergenceSection(const TuningResult& result) {
  using G = GenerationRecord;
  const auto over_trials = [&](auto of) {
    return report::SamplesOf(result.generations, &G::trials, of);
  };
  const auto replaced = [](const G& g) { return g.replaced ? g.best : report::kOpen; };
  std::vector<double> costs;
  for (const G& g : result.generations) costs.insert(costs.end(), {g.best, g.median, g.incumbent});
  return {
      .title = "Convergence",
      .note = fmt::format("The start costs {:.2f}. Every generation has seeds of its own, so that "
                          "the same gains cost more in one than in another; within one, all run "
                          "the same trials.",
                          result.generations.front().incumbent),
      .panels = {{.x = {"trials"},
                  .y = CostAxis("cost of a trial", costs),
                  .series = {{"median of the generation", over_trials(&G::median), report::kGrey,
                              Mark::kLineWithDots},
                             {"its best", over_trials(&G::best), report::CurveColor(0),
                              Mark::kLineWithDots},
                             {"incumbent, same trials", over_trials(&G::incumbent),
                              report::CurveColor(2), Mark::kLineWithDots},
                             {"takes its place", over_trials(replaced), report::CurveColor(1),
                              Mark::kRings, 2, 11}},
                  .legend = true}},
      .wide = true};
}

// The whole range that is searched, and a little more.
report::Axis RangeAxis(const report::Quantity& name, const GainRange& gain) {
  const bool is_log = gain.scale == Scale::kLog;
  const double more = 0.03 * (is_log ? std::log(gain.high / gain.low) : gain.high - gain.low);
  const double low = is_log ? gain.low * std::exp(-more) : gain.low - more,
               high = is_log ? gain.high * std::exp(more) : gain.high + more;
  return {name.Title(), name.factor * low, name.factor * high, is_log};
}

// Of every candidate, against the incumbent on the same trials: what is told of different seeds can
// be compared.
report::Section CostOverGainsSection(const Study& study, const TuningResult& result) {
  report::Section section{.title = "Cost over each gain",
                          .note =
                              "Every candidate: its cost, of that of the incumbent on the same "
                              "trials; below 1 it is better. Dashed: the start; line: the best "
                              "so far.",
                          .wide = true};
  for (size_t i = 0; i < result.start.size(); ++i) {
    const GainRange& gain = study.settings().gains[i];
    const report::Quantity name = batch::NameOfKey(gain.key);
    std::vector<report::Sample> points;
    std::vector<double> costs;
    for (const GenerationRecord& g : result.generations)
      for (const Tried& tried : g.tried) {
        costs.push_back(tried.cost / g.incumbent);
        points.push_back({name.factor * tried.gains[i], costs.back()});
      }
    section.panels.push_back({.title = name.label,
                              .x = RangeAxis(name, gain),
                              .y = CostAxis("cost, of the incumbent's", costs),
                              .series = {{"", points, report::CurveColor(0), Mark::kRings}},
                              .rules = {{1},
                                        {.at = name.factor * result.start[i], .is_up = true},
                                        {.at = name.factor * result.tuned[i],
                                         .color = report::CurveColor(1),
                                         .mark = Mark::kLine,
                                         .is_up = true}}});
  }
  return section;
}

report::Section CostSection(const TuningSettings& settings,
                            const std::optional<HeldOut>& held_out) {
  std::vector<std::string> columns = {"<term", "weight", "more where it fails"};
  if (held_out) columns.insert(columns.end(), {"cost before", "tuned"});
  report::Table table(columns);
  for (size_t i = 0; i < settings.objective.size(); ++i) {
    const ObjectiveTerm& term = settings.objective[i];
    std::vector<report::Cell> row = {fmt::format("|{}|", report::QuantityOf(term.metric).label),
                                     fmt::format("{:g}", term.weight),
                                     fmt::format("{:g}", term.failed)};
    if (held_out)
      for (const double cost : {held_out->terms[i].before, held_out->terms[i].tuned})
        row.push_back(fmt::format("{:.2f}", cost));
    table.Row(row);
  }
  return {.title = "What a trial costs",
          .note = held_out ? "The sum of these terms; means over the held-out trials."
                           : "The sum of these terms.",
          .table = table};
}

report::Section GainsSection(const Study& study, const TuningResult& result) {
  report::Table table({"<gain", "<range", "start", result.finished ? "tuned" : "so far", "<key"});
  for (size_t i = 0; i < result.start.size(); ++i) {
    const GainRange& g = study.settings().gains[i];
    const report::Quantity name = batch::NameOfKey(g.key);
    table.Row({name.Title(),
               fmt::format("{} to {}{}", report::Digits(name.factor * g.low, 3),
                           report::Digits(name.factor * g.high, 3),
                           g.scale == Scale::kLog ? ", log" : ""),
               report::Digits(name.factor * result.start[i]),
               report::Digits(name.factor * result.tuned[i]), g.key});
  }
  return {.title = "Gains", .table = table};
}

}  // namespace

std::string GainsYaml(const Study& study, const TuningResult& result) {
  const trial::Scenario scenario = study.ScenarioOf(study.plan(), 0, result.tuned);
  YAML::Node gains(YAML::NodeType::Map);
  const std::string& controller = scenario.controller_name();
  gains["control"]["use"] = controller;
  gains["control"][controller] = YAML::Load(trial::SaveScenario(scenario))["control"][controller];
  for (size_t i = 0; i < result.tuned.size(); ++i) {
    const std::string& key = study.settings().gains[i].key;
    if (key.starts_with("control." + controller + ".")) continue;
    YAML::Node at = gains;
    size_t begin = 0;
    for (size_t dot = 0; (dot = key.find('.', begin)) != std::string::npos; begin = dot + 1)
      at.reset(at[key.substr(begin, dot - begin)]);
    at[key.substr(begin)] = FormatNumber(result.tuned[i]);
  }
  std::string text = fmt::format("# {}\n{}, study {}, {}.\n", study.plan().title(), kGainsFile.mark,
                                 study.hash(), system::VersionAndCommit());
  if (result.held_out) {
    const batch::Change& success = result.held_out->changes.front();
    text += fmt::format("# {} held-out trials: success {:.1f} % (before: {:.1f} %).\n",
                        success.pairs, 100 * *success.b, 100 * *success.a);
  }
  return text + YAML::Dump(gains) + "\n";
}

report::Report ReportOf(const Study& study, const TuningResult& result) {
  const TuningSettings& settings = study.settings();
  report::Report report{.kind = "tuning",
                        .title = study.plan().title(),
                        .build = system::VersionAndCommit(),
                        .verdict = VerdictOf(study, result),
                        .facts = FactsOf(study, result)};
  if (result.held_out) report.sections.push_back(HeldOutSection(settings, *result.held_out));
  if (!result.generations.empty()) {
    report.sections.push_back(ConvergenceSection(result));
    report.sections.push_back(CostOverGainsSection(study, result));
  }
  report.sections.push_back(GainsSection(study, result));
  report.sections.push_back(CostSection(settings, result.held_out));
  return report;
}

Json TuningJson(const Study& study, const TuningResult& result) {
  Json generations = result.generations;
  for (Json& row : generations) row["gains"] = Named(study, row["gains"]);
  return {{"description", study.plan().settings().description},
          {"study_hash", study.hash()},
          {"version", system::VersionAndCommit()},
          {"finished", result.finished},
          {"ranges", study.settings().gains},
          {"objective", study.settings().objective},
          {"start", Named(study, result.start)},
          {"tuned", Named(study, result.tuned)},
          {"held_out", result.held_out},
          {"generations", generations},
          {"trials", result.trials}};
}

}  // namespace turbidock::tuning
