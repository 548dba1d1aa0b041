#include "experiments/studies/tuning/tuning_report.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "experiments/report/json.h"
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

// Rows whose `gains` get their keys.
Json NamedEach(const Study& study, Json rows) {
  for (Json& row : rows) row["gains"] = Named(study, row["gains"]);
  return rows;
}

std::string Rate(const TrialSummary& s) {
  return fmt::format("{}/{} [{:.0f}, {:.0f}] %", s.successes, s.trials, 100 * s.success.low,
                     100 * s.success.high);
}

std::string Medians(const TrialSummary& s) {
  const auto mm = [](const std::optional<double>& m) {
    return m ? Fixed(units::MmFromM(*m), 1) : "-";
  };
  return fmt::format("{} s, {} mm, {} mm", Fixed(s.time_s, 1), mm(s.error_y_m), mm(s.error_z_m));
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

report::Table Comparisons(const std::vector<Comparison>& comparisons) {
  report::Table table({"<trials", "<docked, before", "<docked, tuned", "<before: time, y, z",
                       "<tuned: time, y, z", "<cost difference", "p (t)", "p (Wilcoxon)",
                       "p (McNemar)"});
  for (const Comparison& c : comparisons)
    table.Row({c.what, Rate(c.start), Rate(c.tuned), Medians(c.start), Medians(c.tuned),
               report::Cell(Difference(c.cost), ToneOf(c.cost)), Probability(c.cost.t_p),
               Probability(c.cost.wilcoxon_p), Probability(c.mcnemar_p)});
  return table;
}

report::Verdict VerdictOf(const Study& study, const TuningResult& result) {
  const int wanted = study.settings().optimiser.generations;
  if (!result.finished)
    return {"not finished", report::Tone::kNone,
            result.search_generations() < wanted
                ? fmt::format("{} of {} generations are done.", result.search_generations(), wanted)
                : "The search is done; what it found is being compared on held-out seeds."};
  const statistics::PairedComparison& cost = result.held_out->cost;
  const std::string reason = fmt::format(
      "On {} held-out seeds the cost of a trial changes by {} {}, p = {} (t).", cost.pairs,
      Difference(cost), study.has_against() ? "from that under `against`" : "from the start",
      Probability(cost.t_p));
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
      {"algorithm", NameOf(optimiser.algorithm)},
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
          "with Wilson's; p of paired t, Wilcoxon's and McNemar's exact tests, all two-sided. "
          "Time and true final errors are medians of the trials that docked.",
      .table = Comparisons({held_out})};
  if (study.has_against())
    section.lines.emplace_back(
        "Before is what the study's `against` says, not the starting gains.");
  if (const statistics::PairedComparison& t = held_out.time_s; t.pairs > 0)
    section.lines.push_back(fmt::format(
        "Where both docked ({} pairs) the tuned gains take {}, p = {} (t), {} (Wilcoxon).", t.pairs,
        Difference(t, " s"), Probability(t.t_p), Probability(t.wilcoxon_p)));
  return section;
}

std::vector<report::Sample> OverTrials(const TuningResult& result, auto of) {
  return report::SamplesOf(result.generations, &GenerationRecord::trials, of);
}

report::Section ConvergenceSection(const TuningResult& result) {
  using G = GenerationRecord;
  // A generation that went astray may leave the picture; what the search is about may not.
  double top = 0;
  for (const G& g : result.generations) top = std::max({top, 1.2 * g.best, 1.2 * g.incumbent});
  const auto replaced = [](const G& g) { return g.replaced ? g.best : report::kOpen; };
  const auto left = [&](const G& g) { return result.generations.front().incumbent - g.gained; };
  const std::vector<report::Series> series = {
      {"median of the generation", OverTrials(result, &G::median), report::kGrey},
      {"its best", OverTrials(result, &G::best), report::CurveColor(0), Mark::kLineWithDots},
      {"incumbent, same trials", OverTrials(result, &G::incumbent), report::CurveColor(2)},
      {"takes its place", OverTrials(result, replaced), report::CurveColor(1), Mark::kRings, 2, 11},
      {"start less gains on new trials", OverTrials(result, left), report::CurveColor(1),
       Mark::kDashedSteps}};
  return {.title = "Convergence",
          .panels = {{.x = {"trials"},
                      .y = {.label = "cost of a trial", .high = top},
                      .series = series,
                      .legend = report::Legend::kAbove}}};
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

report::Section SensitivitySection(const std::vector<Sensitivity>& sensitivity) {
  report::Table table({"<gain", "down to", "<costs", "up to", "<costs"});
  report::Series down{"a step down", {}, report::CurveColor(0), Mark::kBars};
  report::Series up{"a step up", {}, report::CurveColor(1), Mark::kBars};
  report::Panel panel{.y = {"added cost"}, .rules = {{0}}, .legend = report::Legend::kAbove};
  for (const Sensitivity& s : sensitivity) {
    const auto x = static_cast<double>(panel.x.names.size());
    panel.x.names.push_back(s.key);
    const auto &lower = s.cost_down, &higher = s.cost_up;
    table.Row({s.key, GainText(s.down), Difference(lower), GainText(s.up), Difference(higher)});
    down.points.push_back(report::SampleWithin(x - 0.1, lower.mean, lower.confidence));
    up.points.push_back(report::SampleWithin(x + 0.1, higher.mean, higher.confidence));
  }
  panel.series = {down, up};
  return {.title = "Each gain alone",
          .note =
              "Added cost when one gain leaves its tuned value by a step; above zero, the tuned "
              "value is better.",
          .table = table,
          .panels = {panel}};
}

report::Section FrontSection(const Study& study, const std::vector<ParetoPoint>& points) {
  report::Series front{.mark = Mark::kDots, .dot_px = 10};
  // Light to dark, so that it is seen in grey.
  front.scale = {"docked [%]", 0, 100, {236, 170, 60}, {0, 62, 120}};
  for (const ParetoPoint& p : points)
    front.points.push_back({.x = p.worth[0], .y = p.worth[1], .shade = 100 * p.success});
  const std::vector<ObjectiveTerm>& objective = study.settings().objective;
  return {.title = "Pareto front",
          .note = "Gains that no others beat in every objective.",
          .panels = {{.x = {objective[0].metric + ", weighted"},
                      .y = {objective[1].metric + ", weighted"},
                      .series = {front}}}};
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

// Of the map at `path` (dotted), making maps on the way.
void Set(YAML::Node root, const std::string& path, const YAML::Node& value) {
  const size_t dot = path.find('.');
  if (dot == std::string::npos) {
    root[path] = value;
    return;
  }
  const std::string key = path.substr(0, dot);
  if (!root[key]) root[key] = YAML::Node(YAML::NodeType::Map);
  Set(root[key], path.substr(dot + 1), value);
}

}  // namespace

std::string GainsYaml(const Study& study, const TuningResult& result) {
  const farm::Plan plan = study.TrialsOf(0, 1);
  const trial::Scenario scenario = study.ScenarioOf(plan, 0, result.tuned);
  const YAML::Node all = YAML::Load(trial::SaveScenario(scenario));
  YAML::Node gains(YAML::NodeType::Map);
  const std::string law = scenario.controller_name();
  gains["controller"] = law;
  gains[law] = all[law];
  for (size_t i = 0; i < result.tuned.size(); ++i) {
    const std::string& key = study.settings().gains[i].key;
    if (!key.starts_with(law + ".")) Set(gains, key, YAML::Node(FormatNumber(result.tuned[i])));
  }
  std::string text = fmt::format("# {}\n{}, study {}, {}.\n", study.settings().description,
                                 kGainsFile.mark, study.hash(), system::VersionAndCommit());
  if (result.held_out) {
    const Comparison& c = *result.held_out;
    text += fmt::format("# {} held-out trials: docked {} (before: {}), median {} s.\n",
                        c.tuned.trials, Rate(c.tuned), Rate(c.start), Fixed(c.tuned.time_s, 1));
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
  if (!result.generations.empty()) add(ConvergenceSection(result));
  add(GainsSection(study, result));
  if (!result.sensitivity.empty()) add(SensitivitySection(result.sensitivity));
  if (!result.front.empty()) add(FrontSection(study, result.front));
  if (!result.robustness.empty())
    add({.title = fmt::format("When the vehicle or the sea is another{}",
                              settings.proof.robustness_cameras ? ", through the cameras" : ""),
         .table = Comparisons(result.robustness)});
  add(CostSection(settings));
  return report;
}

Json TuningJson(const Study& study, const TuningResult& result) {
  return {{"description", study.settings().description},
          {"study_hash", study.hash()},
          {"version", system::VersionAndCommit()},
          {"finished", result.finished},
          {"algorithm", study.settings().optimiser.algorithm},
          {"ranges", study.settings().gains},
          {"objective", study.settings().objective},
          {"start", Named(study, result.start)},
          {"tuned", Named(study, result.tuned)},
          {"held_out", result.held_out},
          {"robustness", result.robustness},
          {"sensitivity", result.sensitivity},
          {"pareto_front", NamedEach(study, result.front)},
          {"generations", NamedEach(study, result.generations)},
          {"trials", result.trials}};
}

}  // namespace turbidock::tuning
