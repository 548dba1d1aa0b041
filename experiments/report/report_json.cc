#include "experiments/report/report_json.h"

#include <cmath>

#include "sim/base/check.h"

namespace turbidock::report {
namespace {

constexpr int kNewestSchema = 1;

// Sets what is not empty.
void SetText(Json* json, const char* key, const std::string& text) {
  if (!text.empty()) (*json)[key] = text;
}

void SetNumber(Json* json, const char* key, double value) {
  if (std::isfinite(value)) (*json)[key] = value;
}

Json ColumnOf(const std::vector<Sample>& points, double Sample::*value) {
  Json column = Json::array();
  for (const Sample& point : points) {
    const double x = point.*value;
    column.push_back(std::isfinite(x) ? Json(x) : Json());
  }
  return column;
}

Json SeriesJson(const Series& series) {
  Json json = {{"name", series.name},
               {"color", series.color},
               {"mark", series.mark},
               {"width", series.width_px},
               {"dot", series.dot_px},
               {"x", ColumnOf(series.points, &Sample::x)},
               {"y", ColumnOf(series.points, &Sample::y)}};
  if (series.second_axis) json["second"] = true;
  const auto has = [&](double Sample::*value) {
    for (const Sample& point : series.points)
      if (std::isfinite(point.*value)) return true;
    return false;
  };
  if (has(&Sample::low)) json["low"] = ColumnOf(series.points, &Sample::low);
  if (has(&Sample::high)) json["high"] = ColumnOf(series.points, &Sample::high);
  if (has(&Sample::shade)) json["shade"] = ColumnOf(series.points, &Sample::shade);
  if (const auto& scale = series.scale)
    json["scale"] = {{"label", scale->label},
                     {"low", scale->low},
                     {"high", scale->high},
                     {"from", scale->from},
                     {"to", scale->to}};
  if (!series.links.empty()) json["links"] = series.links;
  return json;
}

Json AxisJson(const Axis& axis) {
  Json json = {{"label", axis.label}};
  SetNumber(&json, "low", axis.low);
  SetNumber(&json, "high", axis.high);
  if (axis.logarithmic) json["logarithmic"] = true;
  if (axis.whole) json["whole"] = true;
  if (!axis.names.empty()) json["names"] = axis.names;
  return json;
}

Json BlockJson(const Block& block) {
  Json json = {{"name", block.name}, {"color", block.color}, {"opacity", block.opacity}};
  SetNumber(&json, "x0", block.from_x);
  SetNumber(&json, "x1", block.to_x);
  SetNumber(&json, "y0", block.from_y);
  SetNumber(&json, "y1", block.to_y);
  return json;
}

Json CellJson(const Cell& cell) {
  if (cell.tone == Tone::kNone && cell.link.empty()) return cell.text;
  Json json = {{"text", cell.text}};
  if (cell.tone != Tone::kNone) json["tone"] = cell.tone;
  SetText(&json, "link", cell.link);
  return json;
}

Json TableJson(const Table& table) {
  Json columns = Json::array(), rows = Json::array();
  for (const Table::Column& column : table.columns())
    columns.push_back({{"label", column.title}, {"numeric", !column.is_text}});
  for (const auto& row : table.rows()) {
    Json& cells = rows.emplace_back(Json::array());
    for (const Cell& cell : row) cells.push_back(CellJson(cell));
  }
  return {{"columns", columns}, {"rows", rows}};
}

Json SectionJson(const Section& section) {
  Json json = {{"title", section.title}};
  SetText(&json, "note", section.note);
  if (!section.lines.empty()) json["lines"] = section.lines;
  if (section.table) json["table"] = TableJson(*section.table);
  for (const Panel& panel : section.panels) json["panels"].push_back(PanelJson(panel));
  for (const Command& command : section.commands)
    json["commands"].push_back({{"what", command.what}, {"command", command.command}});
  if (section.stacked) json["stacked"] = true;
  if (section.wide || section.table) json["wide"] = true;
  return json;
}

Json ReportJson(const Report& report) {
  Json json = {{"title", report.title}};
  SetText(&json, "build", report.build);
  if (!report.verdict.word.empty())
    json["verdict"] = {{"word", report.verdict.word},
                       {"tone", report.verdict.tone},
                       {"reason", report.verdict.reason}};
  json["facts"] = Json::array();
  for (const Fact& fact : report.facts)
    json["facts"].push_back({{"label", fact.label}, {"value", fact.value}, {"note", fact.note}});
  json["missing"] = report.missing;
  json["sections"] = Json::array();
  for (const Section& section : report.sections) json["sections"].push_back(SectionJson(section));
  return json;
}

}  // namespace

Json PanelJson(const Panel& panel) {
  Json json = {{"title", panel.title},   {"x", AxisJson(panel.x)},  {"y", AxisJson(panel.y)},
               {"legend", panel.legend}, {"series", Json::array()}, {"rules", Json::array()},
               {"blocks", Json::array()}};
  if (!panel.y2.label.empty()) json["y2"] = AxisJson(panel.y2);
  if (!panel.has_axes) json["has_axes"] = false;
  for (const Series& series : panel.series) json["series"].push_back(SeriesJson(series));
  for (const Rule& rule : panel.rules)
    json["rules"].push_back({{"at", rule.at},
                             {"name", rule.name},
                             {"color", rule.color},
                             {"mark", rule.mark},
                             {"up", rule.is_up}});
  for (const Block& block : panel.blocks) json["blocks"].push_back(BlockJson(block));
  return json;
}

Json Document(const Report& report, const Json& result) {
  Json document = {{"kind", report.kind}, {"schema_version", report.schema_version}};
  document.update(result);
  document["report"] = ReportJson(report);
  return document;
}

Json ReportIn(const Json& document, const std::string& where) {
  const auto is_text = [](const Json& json, const char* key) {
    return json.contains(key) && json[key].is_string();
  };
  if (!document.is_object() || !is_text(document, "kind") || !document.contains("report"))
    throw ConfigError(where + ": is no result that this program wrote with --json or --out");
  const Json& version = document.value("schema_version", Json());
  if (!version.is_number_integer() || version.get<int64_t>() > kNewestSchema)
    throw ConfigError(where + ": schema_version: must be " + std::to_string(kNewestSchema) +
                      ": a newer program wrote it");
  Json report = document["report"];
  if (!report.is_object() || !is_text(report, "title") ||
      !report.value("facts", Json()).is_array() || !report.value("sections", Json()).is_array())
    throw ConfigError(where + ": its report is damaged");
  for (const Json& section : report["sections"])
    if (!section.is_object() || !is_text(section, "title"))
      throw ConfigError(where + ": its report is damaged: a section has no title");
  report["kind"] = document["kind"];
  return report;
}

}  // namespace turbidock::report
