// What a study leaves: its report, in numbers too, and the gains file.

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "experiments/studies/tuning/tuner.h"
#include "experiments/system/build_info.h"
#include "sim/base/units.h"

namespace turbidock::tuning {
namespace {

using report::Fixed;
using report::Json;
using report::Mark;

// The gains by their keys.
Json Named(const Study& study, const std::vector<double>& gains) {
  Json json = Json::object();
  for (size_t i = 0; i < gains.size(); ++i) json[study.settings().gains[i].key] = gains[i];
  return json;
}

std::string Rate(const TrialSummary& s) {
  return fmt::format("{}/{} [{:.0f}, {:.0f}] %", s.successes, s.trials, 100 * s.success_95.low,
                     100 * s.success_95.high);
}

std::string Difference(const statistics::PairedComparison& c, const char* unit = "") {
  return fmt::format("{:+.2f}{} [{:+.2f}, {:+.2f}]", c.mean, unit, c.confidence.low,
                     c.confidence.high);
}

// A cost that differs for sure.
report::Tone ToneOf(const statistics::PairedComparison& cost) {
  if (cost.confidence.high < 0) return report::Tone::kGood;
  return cost.confidence.low > 0 ? report::Tone::kBad : report::Tone::kNone;
}

std::string Probability(double p) { return fmt::format("{:.2g}", p); }
std::string GainText(double value) { return fmt::format("{:.4g}", value); }

report::Table TableOf(const std::vector<ObjectiveTerm>& objective, const Comparison& c) {
  std::vector<std::string> columns = {"<", "<docked", "time s", "y mm", "z mm"};
  for (const ObjectiveTerm& term : objective) columns.push_back("cost of " + term.metric);
  columns.emplace_back("cost");
  report::Table table(columns);
  const auto mm = [](const std::optional<double>& m) {
    return m ? Fixed(units::MmFromM(*m), 1) : "-";
  };
  for (const auto& [name, s] : {std::pair{"before", &c.start}, std::pair{"tuned", &c.tuned}}) {
    std::vector<report::Cell> row = {name, Rate(*s), Fixed(s->time_s_median, 1),
                                     mm(s->final_error_true_y_m_median),
                                     mm(s->final_error_true_z_m_median)};
    for (const double cost : s->cost_by_term) row.emplace_back(Fixed(cost, 2));
    row.emplace_back(Fixed(s->cost_mean, 2));
    table.Row(row);
  }
  std::vector<report::Cell> last(columns.size());
  last.front() = "difference";
  last.back() = report::Cell(Difference(c.cost_difference), ToneOf(c.cost_difference));
  table.Row(last);
  return table;
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
      "On {} held-out seeds the cost of a trial changes by {} from the start, p = {} (t).",
      cost.pairs, Difference(cost), Probability(cost.t_p));
  const report::Tone tone = ToneOf(cost);
  if (tone == report::Tone::kGood) return {"better on held-out seeds", tone, reason};
  if (tone == report::Tone::kBad) return {"worse on held-out seeds", tone, reason};
  return {"no significant difference", tone, reason};
}

std::vector<report::Fact> FactsOf(const Study& study, const TuningResult& result) {
  const search::OptimiserParams& optimiser = study.settings().optimiser;
  const int done = result.search_generations();
  std::vector<report::Fact> facts = {
      {"gains", std::to_string(result.start.size())},
      {"trials", std::to_string(result.trials)},
      {"generations",
       result.finished ? std::to_string(done)
                       : fmt::format("{} of {}", done, optimiser.generations),
       fmt::format("of {} candidates, after the start", optimiser.population)},
      {"study", study.hash(), "digest of all that decides its trials"}};
  if (const auto& c = result.held_out) {
    facts.push_back({"docked before", Rate(c->start), "on held-out seeds"});
    facts.push_back({"docked tuned", Rate(c->tuned), "on held-out seeds"});
  }
  return facts;
}

report::Section HeldOutSection(const Study& study, const Comparison& held_out) {
  report::Section section{
      .title = fmt::format("Before and after, on held-out seeds{}",
                           study.settings().proof.cameras ? ", through the cameras" : ""),
      .note =
          "Differences are tuned less before on the same seeds, with 95 % intervals; docked "
          "with Wilson's; p of paired t and McNemar's exact tests, all two-sided. "
          "Time and true final errors are medians of the trials that docked, the cost is a mean.",
      .lines = {fmt::format("The cost: p = {} (t). Docking: p = {} (McNemar).",
                            Probability(held_out.cost_difference.t_p),
                            Probability(held_out.mcnemar_p))},
      .table = TableOf(study.settings().objective, held_out)};
  if (const statistics::PairedComparison& t = held_out.time_difference_s; t.pairs > 0)
    section.lines.push_back(
        fmt::format("Where both docked ({} pairs) the tuned gains take {}, p = {} (t).", t.pairs,
                    Difference(t, " s"), Probability(t.t_p)));
  return section;
}

std::vector<report::Sample> OverTrials(const TuningResult& result, auto of) {
  return report::SamplesOf(result.generations, &GenerationRecord::trials, of);
}

// Where the search converges: as far as its bests and incumbents go, and the start where it is not
// far above them.
report::Axis CostAxis(const std::vector<GenerationRecord>& generations) {
  const double start = generations.front().incumbent;
  double low = start, high = start;
  for (size_t i = 1; i < generations.size(); ++i) {
    const GenerationRecord& g = generations[i];
    low = std::min({low, g.best, g.incumbent});
    high = std::max({i == 1 ? g.incumbent : high, g.best, g.incumbent});
  }
  if (start > high && start - low < 3 * (high - low)) high = start;
  const double margin = 0.1 * (high - low);
  return {.label = "cost of a trial", .low = low - margin, .high = high + margin};
}

report::Section ConvergenceSection(const Study& study, const TuningResult& result) {
  using G = GenerationRecord;
  const auto panel = [&](const char* title, const report::Axis& y) {
    return report::Panel{.title = title, .x = {"trials"}, .y = y, .legend = report::Legend::kAbove};
  };
  const auto of_incumbent = [&](std::optional<double> TrialSummary::*value, double unit) {
    return OverTrials(result, [value, unit](const G& g) {
      return unit * (g.incumbent_trials.*value).value_or(report::kOpen);
    });
  };
  const auto replaced = [](const G& g) { return g.replaced ? g.best : report::kOpen; };
  const double start = result.generations.front().incumbent;
  const auto left = [&](const G& g) { return start - g.gained; };
  report::Panel cost = panel("cost", CostAxis(result.generations));
  cost.series = {
      {"median of the generation", OverTrials(result, &G::median), report::kGrey},
      {"its best", OverTrials(result, &G::best), report::CurveColor(0), Mark::kLineWithDots},
      {"incumbent, same trials", OverTrials(result, &G::incumbent), report::CurveColor(2)},
      {"takes its place", OverTrials(result, replaced), report::CurveColor(1), Mark::kRings, 2, 11},
      {"start less gains on new trials", OverTrials(result, left), report::CurveColor(1),
       Mark::kDashedSteps}};
  report::Panel terms = panel("the incumbent's cost by its terms", {.label = "cost", .low = 0});
  for (size_t i = 0; i < study.settings().objective.size(); ++i) {
    const auto term = [i](const G& g) { return g.incumbent_trials.cost_by_term[i]; };
    terms.series.push_back({study.settings().objective[i].metric, OverTrials(result, term),
                            report::CurveColor(i), Mark::kLineWithDots});
  }
  report::Panel time = panel("the incumbent's time to dock", {"median of what docked [s]"});
  time.series = {{"", of_incumbent(&TrialSummary::time_s_median, 1), report::CurveColor(2),
                  Mark::kLineWithDots}};
  report::Panel error =
      panel("the incumbent's final error", {.label = "median of what docked [mm]", .low = 0});
  error.series = {{"|y|", of_incumbent(&TrialSummary::final_error_true_y_m_median, 1000),
                   report::CurveColor(0), Mark::kLineWithDots},
                  {"|z|", of_incumbent(&TrialSummary::final_error_true_z_m_median, 1000),
                   report::CurveColor(1), Mark::kLineWithDots}};
  report::Section section{.title = "Convergence", .panels = {cost, terms, time, error}};
  if (start > cost.y.high)
    section.note = fmt::format("The start cost {:.1f}, beyond the top of the first plot.", start);
  return section;
}

report::Section GainsSection(const Study& study, const TuningResult& result) {
  const std::vector<GainRange>& ranges = study.settings().gains;
  report::Table table({"<gain", "<range", "start", result.finished ? "tuned" : "so far"});
  report::Panel panel{.x = {"trials"},
                      .y = {"incumbent, share of its range", 0, 1},
                      .legend = report::Legend::kAbove};
  for (size_t i = 0; i < ranges.size(); ++i) {
    const GainRange& g = ranges[i];
    table.Row({g.key,
               fmt::format("{:g} to {:g}{}", g.low, g.high, g.scale == Scale::kLog ? ", log" : ""),
               GainText(result.start[i]), GainText(result.tuned[i])});
    const auto share = [&](const GenerationRecord& r) { return study.CandidateOf(r.gains)[i]; };
    panel.series.push_back({g.key, OverTrials(result, share), report::CurveColor(i),
                            i < report::kCurveColors.size() ? Mark::kSteps : Mark::kDashedSteps});
  }
  return {.title = "Gains", .table = table, .panels = {panel}};
}

report::Section CostSection(const StudySettings& settings) {
  report::Section section{.title = "What a trial costs", .note = "The sum of these terms."};
  for (const ObjectiveTerm& term : settings.objective)
    section.lines.push_back(fmt::format(
        "{:g} x |{}|{}", term.weight, term.metric,
        term.failed > 0 ? fmt::format(", which of a trial that fails is {:g} more", term.failed)
                        : ""));
  return section;
}

}  // namespace

std::string GainsYaml(const Study& study, const TuningResult& result) {
  const batch::Plan plan = study.TrialsOf(0, 1);
  const trial::Scenario scenario = study.ScenarioOf(plan, 0, result.tuned);
  YAML::Node gains(YAML::NodeType::Map);
  const std::string controller = scenario.controller_name();
  gains["controller"] = controller;
  gains[controller] = YAML::Load(trial::SaveScenario(scenario))[controller];
  for (size_t i = 0; i < result.tuned.size(); ++i) {
    const std::string& key = study.settings().gains[i].key;
    if (key.starts_with(controller + ".")) continue;
    YAML::Node at = gains;
    size_t begin = 0;
    for (size_t dot = 0; (dot = key.find('.', begin)) != std::string::npos; begin = dot + 1)
      at.reset(at[key.substr(begin, dot - begin)]);
    at[key.substr(begin)] = FormatNumber(result.tuned[i]);
  }
  std::string text = fmt::format("# {}\n{}, study {}, {}.\n", study.settings().description,
                                 kGainsFile.mark, study.hash(), system::VersionAndCommit());
  if (result.held_out) {
    const Comparison& c = *result.held_out;
    text +=
        fmt::format("# {} held-out trials: docked {} (before: {}), median {} s.\n", c.tuned.trials,
                    Rate(c.tuned), Rate(c.start), Fixed(c.tuned.time_s_median, 1));
  }
  return text + YAML::Dump(gains) + "\n";
}

report::Report ReportOf(const Study& study, const TuningResult& result) {
  const StudySettings& settings = study.settings();
  report::Report report{
      .kind = "tuning",
      .title = settings.description.empty() ? "tuning study" : settings.description,
      .build = system::VersionAndCommit(),
      .verdict = VerdictOf(study, result),
      .facts = FactsOf(study, result)};
  const auto add = [&](report::Section section) { report.sections.push_back(std::move(section)); };
  if (result.held_out) add(HeldOutSection(study, *result.held_out));
  if (!result.generations.empty()) add(ConvergenceSection(study, result));
  add(GainsSection(study, result));
  add(CostSection(settings));
  return report;
}

Json TuningJson(const Study& study, const TuningResult& result) {
  Json generations = result.generations;
  for (Json& row : generations) row["gains"] = Named(study, row["gains"]);
  return {{"description", study.settings().description},
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
