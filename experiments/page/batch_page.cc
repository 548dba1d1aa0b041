#include "experiments/page/batch_page.h"

#include <optional>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/batch/summary.h"
#include "experiments/page/stored_trials.h"
#include "experiments/page/trial_model.h"
#include "experiments/report/report_json.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/trial_view.h"

namespace turbidock::page {
namespace {

using batch::StoredTrial;
using report::Json;

// A column of values for each key.
Json ParametersOf(const std::vector<std::string>& keys, const std::vector<StoredTrial>& trials) {
  Json parameters = Json::object();
  for (size_t k = 0; k < keys.size(); ++k) {
    Json& values = parameters[keys[k]] = Json::array();
    for (const StoredTrial& trial : trials)
      values.push_back(Rounded(batch::ValueOf(trial.parameters[k])));
  }
  return parameters;
}

// Columns of the trials' records that a page shows.
bool IsShown(const trial::Column& column) {
  return column.name != "digest" && column.name != "seed" && column.name != "docked" &&
         column.name != "log";
}

Json ColumnsOf(const std::vector<StoredTrial>& trials) {
  const std::vector<trial::Column>& columns = trial::Columns();
  Json all = {{"trial", Json::array()}, {"seed", Json::array()}};
  for (const StoredTrial& trial : trials) {
    const std::vector<trial::Cell> row = trial::CellsOf(trial.record);
    for (size_t i = 0; i < row.size(); ++i)
      if (IsShown(columns[i])) all[columns[i].name].push_back(Rounded(row[i]));
    all["trial"].push_back(trial.trial);
    all["seed"].push_back(std::to_string(trial.record.seed));
  }
  for (const trial::Column& column : columns)  // of which nothing is known
    if (all.contains(column.name) && all[column.name] == Json(trials.size(), Json()))
      all.erase(column.name);
  return all;
}

}  // namespace

Page BatchPage(const batch::ResultStore& store, const std::string& file,
               const BatchPageOptions& options) {
  const batch::StoreHeader& header = store.header();
  const std::vector<StoredTrial> trials = store.Trials();
  Page page;
  Json& model = page.model;
  model = {{"kind", "batch"},
           {"kind_title", header.kind == "batch" ? "batch" : header.kind + ": its trials"},
           {"build", header.build},
           {"file", file},
           {"store_kind", header.kind},
           {"rows", trials.size()},
           {"columns", ColumnsOf(trials)},
           {"parameters", ParametersOf(header.keys, trials)},
           {"names", Json::object()},
           {"series_trials", Json::array()},
           {"missing", Json::array()}};
  for (const char* of : {"columns", "parameters"})
    for (const auto& [key, values] : model[of].items()) model["names"][key] = batch::NameOfKey(key);
  StoredTrials stored(store, file, "", options.series_bytes, options.plugins, &page);
  if (const std::optional<batch::Plan>& plan = stored.plan())
    for (const batch::GridAxis& axis : plan->grid()) model["grid"].push_back(axis.key);
  if (stored.plan() && !trials.empty())
    model["limits"] =
        trial::CriteriaOf(stored.plan()->ScenarioOf(stored.plan()->Trial(trials[0].trial)));
  for (const bool success : {false, true})
    for (const StoredTrial& trial : trials)
      if (trial.record.success() == success && stored.Pack(trial))
        model["series_trials"].push_back(trial.trial);
  model["series_stored"] = stored.count();
  const batch::BatchSummary summary = batch::SummaryOf(store, file, options.report);
  model["report"] = report::Document(batch::ReportOf(summary), Json::object())["report"];
  model["title"] = summary.title;
  for (const Json& sentence : model["report"]["missing"]) model["missing"].push_back(sentence);
  return page;
}

}  // namespace turbidock::page
