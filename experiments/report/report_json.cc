#include "experiments/report/report_json.h"

#include <cmath>

#include "sim/base/check.h"

namespace turbidock::report {
namespace {

constexpr int kNewestSchema = 1;

Json ColumnOf(const std::vector<Sample>& points, double Sample::*value) {
  Json column = Json::array();
  for (const Sample& point : points)
    column.push_back(std::isfinite(point.*value) ? Json(point.*value) : Json());
  return column;
}

}  // namespace

// A cell that is only text is a text.
void to_json(Json& json, const Cell& cell) {
  json = cell.text;
  if (cell.tone == Tone::kNone && cell.link.empty()) return;
  json = {{"text", cell.text}, {"tone", cell.tone}};
  if (!cell.link.empty()) json["link"] = cell.link;
}

void to_json(Json& json, const Table& table) {
  Json columns = Json::array();
  for (const Table::Column& column : table.columns())
    columns.push_back({{"label", column.title}, {"numeric", !column.is_text}});
  json = {{"columns", columns}, {"rows", table.rows()}};
}

// In columns; those of a span where there is any, and always of a band, which may grow.
void to_json(Json& json, const Series& series) {
  json = {{"name", series.name},
          {"color", series.color},
          {"mark", series.mark},
          {"width", series.width_px},
          {"dot", series.dot_px},
          {"second", series.second_axis},
          {"opacity", series.opacity},
          {"x", ColumnOf(series.points, &Sample::x)},
          {"y", ColumnOf(series.points, &Sample::y)},
          {"links", series.links}};
  for (const auto& [key, value] : {std::pair{"low", &Sample::low}, {"high", &Sample::high}})
    if (Json column = ColumnOf(series.points, value);
        series.mark == Mark::kBand || column != Json(column.size(), Json()))
      json[key] = std::move(column);
}

Json Document(const Report& report, const Json& result) {
  Json document = {{"kind", report.kind}, {"schema_version", report.schema_version}};
  document.update(result);
  document["report"] = report;
  return document;
}

Json ReportIn(const Json& document, const std::string& where) {
  if (!document.is_object() || !document.contains("kind") || !document.contains("report"))
    throw ConfigError(where + ": is no result that this program wrote with --json or --out");
  const Json version = document.value("schema_version", Json());
  if (!version.is_number_integer() || version > kNewestSchema)
    throw ConfigError(where + ": schema_version: must be " + std::to_string(kNewestSchema) +
                      ": a newer program wrote it");
  try {
    Json report = document["report"];
    report["kind"] = document["kind"].get<std::string>();
    report.at("title").get_ref<const std::string&>();
    report.at("facts").get_ref<const Json::array_t&>();
    for (const Json& section : report.at("sections").get_ref<const Json::array_t&>())
      section.at("title").get_ref<const std::string&>();
    return report;
  } catch (const Json::exception& error) {
    throw ConfigError(where + ": its report is damaged: " + error.what());
  }
}

}  // namespace turbidock::report
