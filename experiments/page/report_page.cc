#include "experiments/page/report_page.h"

#include "experiments/report/report_json.h"

namespace turbidock::page {

using report::Json;

namespace {

Json TrialJson(const LinkedTrial& trial) {
  Json json = {{"title", trial.title},   {"outcome", trial.outcome}, {"reason", trial.reason},
               {"note", trial.note},     {"model", trial.model},     {"series", trial.series},
               {"facts", Json::array()}, {"commands", Json::array()}};
  for (const report::Fact& fact : trial.facts)
    json["facts"].push_back({{"label", fact.label}, {"value", fact.value}, {"note", fact.note}});
  for (const report::Command& command : trial.commands)
    json["commands"].push_back({{"what", command.what}, {"command", command.command}});
  return json;
}

}  // namespace

Page ReportPage(const Json& document, const std::string& where) {
  Page page;
  Json& model = page.model;
  model = report::ReportIn(document, where);
  model["kind_title"] = model["kind"];
  model["kind"] = "report";  // the module that shows it
  model["links"] = Json::object();
  return page;
}

void AddLink(const std::string& id, const Link& link, Page* page) {
  Json trials = Json::array();
  for (const LinkedTrial& trial : link.trials) trials.push_back(TrialJson(trial));
  page->model["links"][id] = {{"title", link.title}, {"note", link.note}, {"trials", trials}};
}

void AddPart(const std::string& name, const Json& part, bool has_3d, Page* page) {
  page->parts[name] = report::JsonLine(part);
  page->has_3d |= has_3d;
}

}  // namespace turbidock::page
