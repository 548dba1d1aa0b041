#include "experiments/studies/tuning/tuning_report.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "experiments/media/figure.h"
#include "experiments/report/json.h"
#include "experiments/report/table.h"
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

std::string Comparisons(const std::vector<Comparison>& comparisons) {
  report::Table table({"<trials", "<docked, before", "<docked, tuned", "<before: time, y, z",
                       "<tuned: time, y, z", "<cost difference", "<t", "<Wilcoxon", "<McNemar"});
  const auto p = [](double value) { return fmt::format("{:.2g}", value); };
  for (const Comparison& c : comparisons)
    table.Row({c.what, Rate(c.start), Rate(c.tuned), Medians(c.start), Medians(c.tuned),
               Difference(c.cost), p(c.cost.t_p), p(c.cost.wilcoxon_p), p(c.mcnemar_p)});
  return table.Markdown();
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

std::string TuningJson(const Study& study, const TuningResult& result) {
  return report::JsonText({{"description", study.settings().description},
                           {"study_hash", study.hash()},
                           {"version", system::VersionAndCommit()},
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
                           {"trials", result.trials}});
}

std::string TuningMarkdown(const Study& study, const TuningResult& result) {
  const StudySettings& settings = study.settings();
  std::string text = fmt::format(
      "# {}\n\nStudy {}, {}. {} with {} candidates a generation, {} generations, {} trials in "
      "all.\n\n"
      "| gain | range | start | tuned |\n|---|---|---|---|\n",
      settings.description, study.hash(), system::VersionAndCommit(),
      NameOf(settings.optimiser.algorithm), settings.optimiser.population,
      settings.optimiser.generations, result.trials);
  for (size_t i = 0; i < settings.gains.size(); ++i) {
    const GainRange& g = settings.gains[i];
    text += fmt::format("| {} | {:g} to {:g} | {:.4g} | {:.4g} |\n", g.key, g.low, g.high,
                        result.start[i], result.tuned[i]);
  }
  text += "\nA trial costs";
  for (const ObjectiveTerm& term : settings.objective)
    text += fmt::format(" {} {:g} x |{}|", &term == settings.objective.data() ? "" : "+",
                        term.weight, term.metric);
  text +=
      ". Differences are tuned less before on the same seeds, with 95 % intervals; docked with "
      "Wilson's; p of paired t, Wilcoxon's and McNemar's exact tests, all two-sided. Time and "
      "true final errors are medians of the trials that docked.\n\n";
  if (result.held_out) {
    text += fmt::format("## On held-out seeds{}\n\n",
                        settings.proof.cameras ? ", through the cameras" : "");
    if (study.has_against())
      text += "Before is what the study's `against` says, not the starting gains.\n\n";
    text += Comparisons({*result.held_out});
    const statistics::PairedComparison& t = result.held_out->time_s;
    if (t.pairs > 0)
      text += fmt::format(
          "\nWhere both docked ({} pairs) the tuned gains take {}, p = {:.2g} (t), {:.2g} "
          "(Wilcoxon).\n",
          t.pairs, Difference(t, " s"), t.t_p, t.wilcoxon_p);
  }
  if (!result.robustness.empty()) {
    text += fmt::format("\n## When the vehicle or the sea is another{}\n\n{}",
                        settings.proof.robustness_cameras ? ", through the cameras" : "",
                        Comparisons(result.robustness));
  }
  if (!result.sensitivity.empty()) {
    report::Table table({"<gain", "<down to", "<costs", "<up to", "<costs"});
    const auto gain = [](double value) { return fmt::format("{:.4g}", value); };
    for (const Sensitivity& s : result.sensitivity)
      table.Row({s.key, gain(s.down), Difference(s.cost_down), gain(s.up), Difference(s.cost_up)});
    text += "\n## Each gain alone\n\n" + table.Markdown();
  }
  return text;
}

void WriteTuningFigure(const std::string& path, const Study& study, const TuningResult& result) {
  using G = GenerationRecord;
  const StudySettings& settings = study.settings();
  // A generation that went astray may leave the picture; what the search is about may not.
  double top = 0;
  for (const G& g : result.generations) top = std::max({top, 1.2 * g.best, 1.2 * g.incumbent});
  const auto over_trials = [&](auto of) {
    return report::SamplesOf(result.generations, &G::trials, of);
  };
  const auto replaced = [](const G& g) { return g.replaced ? g.best : report::kOpen; };
  const auto left = [&](const G& g) { return result.generations.front().incumbent - g.gained; };
  report::Panel costs{
      .x = {"trials"},
      .y = {.label = "cost of a trial", .high = top},
      .series = {{"median of the generation", over_trials(&G::median), report::kGrey},
                 {"its best", over_trials(&G::best), report::CurveColor(0), Mark::kLineWithDots},
                 {"incumbent, same trials", over_trials(&G::incumbent), report::CurveColor(2)},
                 {"takes its place", over_trials(replaced), report::CurveColor(1), Mark::kRings, 2,
                  11},
                 {"start less gains on new trials", over_trials(left), report::CurveColor(1),
                  Mark::kDashedSteps}},
      .legend = report::Legend::kBeside};
  report::Panel gains{
      .x = costs.x, .y = {"incumbent, share of its range", 0, 1}, .legend = costs.legend};
  for (size_t i = 0; i < settings.gains.size(); ++i)
    gains.series.push_back({settings.gains[i].key,
                            over_trials([&](const G& g) { return study.CandidateOf(g.gains)[i]; }),
                            report::CurveColor(i),
                            i < report::kCurveColors.size() ? Mark::kSteps : Mark::kDashedSteps});

  std::vector<report::Panel> panels = {costs, gains};
  if (!result.front.empty()) {
    report::Series front{.mark = Mark::kDots, .dot_px = 10};
    // Light to dark, so that it is seen in grey.
    front.scale = {"docked [%]", 0, 100, {236, 170, 60}, {0, 62, 120}};
    for (const ParetoPoint& p : result.front)
      front.points.push_back({.x = p.worth[0], .y = p.worth[1], .shade = 100 * p.success});
    panels.push_back({.title = "not beaten in every objective",
                      .x = {settings.objective[0].metric + ", weighted"},
                      .y = {settings.objective[1].metric + ", weighted"},
                      .series = {front}});
  } else if (!result.sensitivity.empty()) {
    report::Series down{"a step down", {}, report::CurveColor(0), Mark::kBars};
    report::Series up{"a step up", {}, report::CurveColor(1), Mark::kBars};
    report::Panel panel{.y = {"added cost"}, .legend = costs.legend};
    for (const Sensitivity& s : result.sensitivity) {
      const auto x = static_cast<double>(panel.x.names.size());
      panel.x.names.push_back(s.key);
      const auto &lower = s.cost_down, &higher = s.cost_up;
      down.points.push_back(report::SampleWithin(x - 0.1, lower.mean, lower.confidence));
      up.points.push_back(report::SampleWithin(x + 0.1, higher.mean, higher.confidence));
    }
    panel.series = {down, up};
    panels.push_back(panel);
  }
  media::WriteFigure(
      path, {.title = settings.description, .width_px = 1300, .height_px = 380, .panels = panels});
}

}  // namespace turbidock::tuning
