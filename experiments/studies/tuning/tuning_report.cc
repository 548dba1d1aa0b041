#include "experiments/studies/tuning/tuning_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "experiments/config/yaml_fields.h"
#include "experiments/media/gnuplot.h"
#include "experiments/report/json.h"
#include "experiments/report/table.h"
#include "experiments/system/build_info.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/units.h"

namespace turbidock::tuning {
namespace {

using report::Fixed;
using report::Json;

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

std::string Color(const Rgb& rgb) {
  return fmt::format("'#{:02x}{:02x}{:02x}'", rgb[0], rgb[1], rgb[2]);
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

constexpr size_t kGnuplotColors = 8;  // before they repeat

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
  const std::string law = NameOf(scenario.control.law);
  gains["controller"] = law;
  gains[law] = all[law];
  for (size_t i = 0; i < result.tuned.size(); ++i) {
    const std::string& key = study.settings().gains[i].key;
    if (!key.starts_with(law + ".")) Set(gains, key, YAML::Node(FormatNumber(result.tuned[i])));
  }
  std::string text =
      fmt::format("# {}\n# Found by `turbidock tune`, study {}, {}.\n",
                  study.settings().description, study.hash(), system::VersionAndCommit());
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
  const StudySettings& settings = study.settings();
  media::GnuplotScript script;
  script.BeginData("generations");
  for (const GenerationRecord& g : result.generations)
    script.Row({static_cast<double>(g.trials), g.best, g.median, g.incumbent,
                result.generations.front().incumbent - g.gained});
  script.EndData();
  script.BeginData("replaced");
  bool any = false;
  for (const GenerationRecord& g : result.generations)
    if (g.replaced) {
      script.Row({static_cast<double>(g.trials), g.best});
      any = true;
    }
  if (!any) script.Row({std::nan(""), std::nan("")});
  script.EndData();
  script.BeginData("gains");
  for (const GenerationRecord& g : result.generations) {
    const Candidate candidate = study.CandidateOf(g.gains);
    for (size_t i = 0; i < candidate.size(); ++i)
      script.Row({static_cast<double>(g.trials), static_cast<double>(i), candidate[i]});
  }
  script.EndData();
  const bool front = !result.front.empty(), sensitivity = !result.sensitivity.empty();
  const int rows = 2 + (front || sensitivity ? 1 : 0);
  script.Line(fmt::format("set multiplot layout {},1 title {}", rows,
                          media::GnuplotQuoted(settings.description)));
  script.Line("set grid linecolor rgb '#d8dce0'").Line("set border 3").Line("set tics nomirror");
  script.Line("set key outside right top").Line("set rmargin 36");
  script.Line("set xlabel 'trials' offset 0,0.5").Line("set ylabel 'cost of a trial'");
  // A generation that went astray may leave the picture; what the search is about may not.
  double top = 0;
  for (const GenerationRecord& g : result.generations)
    top = std::max({top, 1.2 * g.best, 1.2 * g.incumbent});
  script.Line(fmt::format("set yrange [*:{}]", top));
  script.Line(fmt::format(
      "plot $generations using 1:3 with lines linewidth 1.5 linecolor rgb {} title 'median of the "
      "generation', $generations using 1:2 with linespoints pointtype 7 pointsize 0.5 linewidth "
      "1.5 "
      "linecolor rgb {} title 'its best', $generations using 1:4 with lines linewidth 2.5 "
      "linecolor "
      "rgb {} title 'incumbent, same trials', $replaced using 1:2 with points pointtype 6 "
      "pointsize "
      "1.6 linewidth 2 linecolor rgb {} title 'takes its place', $generations using 1:5 with steps "
      "linewidth 2 dashtype 2 linecolor rgb {} "
      "title 'start less gains on new trials'",
      Color(trial::kOnPaper.truth), Color(trial::kOnPaper.estimate), Color(trial::kOnPaper.limit),
      Color(trial::kOnPaper.desired), Color(trial::kOnPaper.desired)));
  script.Line("set ylabel 'incumbent, share of its range'").Line("set yrange [0:1]");
  std::string plot;
  for (size_t i = 0; i < settings.gains.size(); ++i)
    plot += fmt::format(
        "{}$gains using 1:($2=={}?$3:1/0) with steps linewidth 2 linecolor {} dashtype {} title {}",
        i == 0 ? "plot " : ", ", i, 1 + i % kGnuplotColors, 1 + i / kGnuplotColors,
        media::GnuplotQuoted(settings.gains[i].key));
  script.Line("set datafile missing 'NaN'").Line(plot).Line("set yrange [*:*]");
  if (front) {
    script.BeginData("front");
    for (const ParetoPoint& p : result.front) script.Row({p.worth[0], p.worth[1], 100 * p.success});
    script.EndData();
    script.Line("set xlabel " + media::GnuplotQuoted(settings.objective[0].metric + ", weighted"));
    script.Line("set ylabel " + media::GnuplotQuoted(settings.objective[1].metric + ", weighted"));
    script.Line("set cblabel 'docked [%]'").Line("set cbrange [0:100]");
    script.Line(fmt::format("set palette defined (0 {}, 1 {})", Color(trial::kOnPaper.desired),
                            Color(trial::kOnPaper.estimate)));
    script.Line(
        "plot $front using 1:2:3 with points pointtype 7 pointsize 1.4 palette title "
        "'not beaten in every objective'");
  } else if (sensitivity) {
    script.BeginData("sensitivity");
    for (size_t i = 0; i < result.sensitivity.size(); ++i) {
      const Sensitivity& s = result.sensitivity[i];
      script.Row({static_cast<double>(i), s.cost_down.mean, s.cost_down.confidence.low,
                  s.cost_down.confidence.high, s.cost_up.mean, s.cost_up.confidence.low,
                  s.cost_up.confidence.high});
    }
    script.EndData();
    std::string tics;
    for (size_t i = 0; i < result.sensitivity.size(); ++i)
      tics += fmt::format("{}{} {}", i == 0 ? "" : ", ",
                          media::GnuplotQuoted(result.sensitivity[i].key), i);
    script.Line("set xtics (" + tics + ") rotate by -35").Line("unset xlabel");
    script.Line("set ylabel 'added cost'");
    script.Line(
        fmt::format("set xrange [-0.5:{}]", static_cast<double>(result.sensitivity.size()) - 0.5));
    script.Line(fmt::format(
        "plot $sensitivity using ($1-0.1):2:3:4 with yerrorbars pointtype 7 linewidth 2 linecolor "
        "rgb {} title 'a step down', $sensitivity using ($1+0.1):5:6:7 with yerrorbars pointtype 7 "
        "linewidth 2 linecolor rgb {} title 'a step up'",
        Color(trial::kOnPaper.estimate), Color(trial::kOnPaper.desired)));
  }
  script.Line("unset multiplot");
  script.WritePng(path, 1300, 380 * rows + 40);
}

}  // namespace turbidock::tuning
