#include "experiments/page/report_page.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "experiments/page/trial_page.h"
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

// What the cells of a report's tables open.
std::set<std::string> LinksIn(const Json& model) {
  std::set<std::string> links;
  for (const Json& section : model["sections"])
    for (const Json& row : section.value("table", Json::object()).value("rows", Json::array()))
      for (const Json& cell : row)
        if (cell.is_object() && cell.contains("link")) links.insert(cell["link"]);
  return links;
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

void AddTrialsIn(const std::string& folder, const trial::Plugins& plugins, Page* page) {
  namespace fs = std::filesystem;
  const std::set<std::string> links = LinksIn(page->model);
  std::vector<fs::path> trials;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none))
    if (links.contains(entry.path().filename().string()) &&
        fs::is_regular_file(entry.path() / "result.json", none))
      trials.push_back(entry.path());
  std::sort(trials.begin(), trials.end());
  for (const fs::path& path : trials) try {
      const std::string name = path.filename().string(), part = "trial-" + name;
      const Page trial = TrialPage(path.string(), plugins);
      const Json& record = trial.model["record"];
      LinkedTrial linked{.title = trial.model.value("title", name),
                         .outcome = record["outcome"],
                         .reason = record.value("reason", ""),
                         .model = part};
      for (const Json& command : trial.model["commands"])
        linked.commands.push_back({command["what"], command["command"]});
      AddLink(name, {.title = name, .trials = {linked}}, page);
      AddPart(part, trial.model, trial.has_3d, page);
    } catch (const ConfigError& error) {
      page->model["missing"].push_back(error.what());
    }
}

void AddPart(const std::string& name, const Json& part, bool has_3d, Page* page) {
  page->parts[name] = report::JsonLine(part);
  page->has_3d |= has_3d;
}

}  // namespace turbidock::page
