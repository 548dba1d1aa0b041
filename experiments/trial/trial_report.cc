#include "experiments/trial/trial_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/report/table.h"
#include "experiments/trial/trace_panels.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/units.h"
#include "sim/light/scattering.h"

namespace turbidock::trial {
namespace {

using report::Fixed;
using report::Json;
using report::Section;

std::optional<double> NumberOf(const Json& record, const char* key, double factor = 1) {
  const Json value = record.value(key, Json());
  return value.is_number() ? std::optional(factor * value.get<double>()) : std::nullopt;
}

// The record without what is noise: the estimate where nothing is detected, and what never began.
Json WithoutNoise(Json record, const Series& series, const ViewCriteria& criteria) {
  const std::vector<double>& times = series.Numbers("time_s");
  const double end_s = NumberOf(record, "time_s").value_or(INFINITY);
  const auto after = std::ranges::upper_bound(times, end_s + 1e-9);
  const std::optional<double> fitness =
      after == times.begin()
          ? NumberOf(record, "fitness_best")
          : series.Numbers("fitness")[static_cast<size_t>(after - times.begin() - 1)];
  if (fitness.value_or(-1) < criteria.detection_fitness) record["final_error_estimated"] = nullptr;
  const Json transitions = record.value("transitions", Json::array());
  if (std::ranges::none_of(transitions, [](const Json& t) { return t["to"] == "visual_servoing"; }))
    record["tracking_rms_m"] = record["overshoot_m"] = nullptr;
  // of a pole elsewhere the depth says nothing
  if (record.value("inserted", Json()) != true) record["insertion_depth_m"] = nullptr;
  return record;
}

std::vector<report::Fact> FactsOf(const Scenario& scenario, const Json& record) {
  const Json error = record.value("final_error_true", Json::object());
  const auto mm = [](const Json& object, const char* key) {
    return Fixed(NumberOf(object, key, units::MmFromM(1)), 0);
  };
  const auto depth = NumberOf(record, "insertion_depth_m");
  std::vector<report::Fact> facts = {
      {"time", Fixed(NumberOf(record, "time_s"), 1) + " s"},
      {"true error",
       fmt::format("x {}, y {}, z {} mm", mm(error, "x_m"), mm(error, "y_m"), mm(error, "z_m")),
       "of x, y and z at that time"},
      {"yaw", Fixed(NumberOf(error, "yaw_rad", units::DegFromRad(1)), 1) + "°",
       "true error at that time"},
      {"F, mean", Fixed(NumberOf(record, "fitness_mean"), 2),
       std::string("over all frames. ") + kFitnessMeaning},
      {"pole in", depth ? mm(record, "insertion_depth_m") + " mm" : "-",
       "depth of the pole's tip past the dock's mouth, at the end"},
      {"false confidence", Fixed(NumberOf(record, "false_confidence_s"), 1) + " s",
       "in which the estimate claimed to be nearer than it was"},
      {"returns", Fixed(NumberOf(record, "returns_to_servoing"), 0),
       "from docking to visual servoing"}};
  if (const auto sight = Sight_m(scenario))
    facts.push_back({"one could see", report::Digits(*sight, 2) + " m",
                     "where green light has left 2 % of a contrast"});
  return facts;
}

Section Stages(const Scenario& scenario, const Json& transitions) {
  report::Table table({"time, s", "<from", "<to", "<why"});
  for (const Json& t : transitions) {
    const double time_s = scenario.clock.TimeOfFrame(t["frame"].get<int64_t>());
    table.Row({{fmt::format("{:.1f}", time_s), report::Tone::kNone, fmt::format("t={}", time_s)},
               report::Words(t["from"]),
               report::Words(t["to"]),
               t["reason"].get<std::string>()});
  }
  return {.title = "Stages", .table = table};
}

// Leaves of a document, key by dotted key.
void Flatten(const config::YamlNode& node, std::vector<std::pair<std::string, std::string>>* out) {
  if (!node.IsMap()) {
    out->emplace_back(node.path, node.OneLine());
    return;
  }
  for (const auto& [key, inner] : node.Entries()) Flatten(inner, out);
}

std::vector<std::pair<std::string, std::string>> ValuesOf(const Scenario& scenario) {
  std::vector<std::pair<std::string, std::string>> values;
  Flatten(config::ParseYaml(SaveScenario(scenario), "scenario"), &values);
  return values;
}

// The keys whose values differ from what every scenario with these presets begins with.
Section Settings(const Scenario& scenario) {
  std::map<std::string, std::string> defaults;
  for (const auto& [key, value] : ValuesOf(PresetsOf(scenario))) defaults[key] = value;
  const auto usual_presets = ValuesOf(Scenario());
  for (const auto& [key, value] : usual_presets)
    if (key == "vehicle.model" || key == "cameras.optics") defaults[key] = value;
  report::Table table({"<key", "<here", "<default"});
  for (const auto& [key, value] : ValuesOf(scenario)) {
    // no scenario is without these: they have no default; of files a digest says nothing to people
    if (key == "schema_version" || key == "description" || key == "trial.seed" ||
        key == "trial.model_files")
      continue;
    if (key == "trial.duration_s" || key == "trial.scene") defaults[key].clear();
    const std::string& usual = defaults[key];
    if (usual != value) table.Row({key, value, usual.empty() ? "-" : usual});
  }
  Section section{.title = "Settings that differ", .note = "From what every scenario begins with."};
  if (table.rows().empty())
    section.lines = {"None."};
  else
    section.table = table;
  return section;
}

std::string Shown(const Json& value, const report::Quantity& of) {
  if (value.is_number()) return of.Text(report::Digits(of.factor * value.get<double>()));
  if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
  if (value.is_string() && !value.get_ref<const std::string&>().empty()) return value;
  if (!value.is_array()) return "-";
  std::vector<std::string> texts;
  for (const Json& element : value) texts.push_back(Shown(element, {}));
  return texts.empty() ? "none" : fmt::format("{}", fmt::join(texts, ", "));
}

// A record's values by their dotted keys, which are their notes.
void AddFigures(const Json& record, const std::string& path, std::vector<report::Fact>* facts) {
  const report::Quantity group = report::QuantityOf(path);
  std::set<std::string> labels;
  for (const auto& [key, value] : record.items()) {
    const std::string name = JoinKey(path, key);
    if (key == "transitions" || key == "reason" || key == "log") continue;
    if (value.is_object()) {
      AddFigures(value, name, facts);
      continue;
    }
    report::Quantity of = report::QuantityOf(key);
    if (!path.empty()) of.label = group.label + ", " + of.label;
    if (of.unit.empty()) {  // stage_time_s.docking
      of.unit = group.unit;
      of.factor = group.factor;
    }
    // handover_navigation_error_m and _rad
    if (!labels.insert(of.label).second) of.label += " in " + of.unit;
    facts->push_back({of.label, Shown(value, of), name});
  }
}

}  // namespace

std::vector<Section> TraceSections(const Series& series, const ViewCriteria& criteria,
                                   size_t first_row) {
  const std::string note = fmt::format(
      "{}. Area I, from {:.2f}: it may dock; Area II, from {:.2f}: detected; Area III: not.",
      kFitnessMeaning, criteria.docking_fitness, criteria.detection_fitness);
  return {{.title = "3D replay", .player = "replay"},
          {.title = "Cameras", .player = "cameras"},
          {.title = "What happened",
           .note = note,
           .panels = TracePanels(series, criteria, {first_row}),
           .stacked = true}};
}

std::optional<double> Sight_m(const Scenario& scenario) {
  if (scenario.pose_source != PoseSource::kCameras) return std::nullopt;
  return std::log(50) / light::MakeMedium(scenario.light.water).extinction_per_m()[1];
}

std::string TitleOf(const Scenario& scenario) {
  return fmt::format("{}, seed {}", scenario.description, scenario.seed);
}

report::Report ReportOf(const Scenario& scenario, const Json& result, const Series& series) {
  const ViewCriteria criteria = CriteriaOf(scenario);
  const Json record = WithoutNoise(result, series, criteria);
  const std::string outcome = record.value("outcome", "");
  using enum report::Tone;
  report::Report report{.kind = "trial",
                        .title = TitleOf(scenario),
                        .build = record.value("version", ""),
                        .verdict = {report::Words(outcome),
                                    outcome == "success"       ? kGood
                                    : outcome == "interrupted" ? kNone
                                                               : kBad,
                                    report::Spoken(record.value("reason", ""))},
                        .facts = FactsOf(scenario, record),
                        .sections = TraceSections(series, criteria)};
  if (series.rows() == 0) report.missing.emplace_back("No curves: the log has no rows.");
  if (const Json stages = record.value("transitions", Json::array()); !stages.empty())
    report.sections.push_back(Stages(scenario, stages));
  try {
    report.sections.push_back(Settings(scenario));
  } catch (const ConfigError& error) {
    report.missing.push_back(fmt::format("No comparison with the defaults: {}", error.what()));
  }
  Section figures{.title = "All figures", .wide = true};
  AddFigures(record, "", &figures.facts);
  report.sections.push_back(figures);
  return report;
}

}  // namespace turbidock::trial
