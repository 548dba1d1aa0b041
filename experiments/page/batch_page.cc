#include "experiments/page/batch_page.h"

#include <fmt/format.h>

#include <optional>
#include <utility>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/page/stored_trials.h"
#include "experiments/page/trial_model.h"
#include "experiments/page/trial_page.h"
#include "experiments/report/report_json.h"
#include "experiments/trial/record_columns.h"

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
  if (column.storage == trial::Storage::kLog || column.storage == trial::Storage::kNowhere)
    return false;
  return column.name != "digest" && column.name != "seed" && column.name != "docked";
}

Json ColumnsOf(const std::vector<StoredTrial>& trials) {
  const std::vector<trial::Column>& columns = trial::Columns();
  std::vector<Json> values(columns.size(), Json::array());
  Json numbers = Json::array(), seeds = Json::array();
  for (const StoredTrial& trial : trials) {
    const std::vector<trial::Cell> row = trial::CellsOf(trial.record);
    for (size_t i = 0; i < row.size(); ++i)
      if (IsShown(columns[i])) values[i].push_back(Rounded(row[i]));
    numbers.push_back(trial.trial);
    seeds.push_back(std::to_string(trial.record.seed));
  }
  Json all = {{"trial", numbers}, {"seed", seeds}};
  for (size_t i = 0; i < columns.size(); ++i)  // none of which nothing is known
    if (IsShown(columns[i]) && values[i] != Json(trials.size(), Json()))
      all[columns[i].name] = std::move(values[i]);
  return all;
}

// Failures first, then the others, each in their order.
std::vector<int64_t> InOrderOfInterest(const std::vector<StoredTrial>& trials) {
  std::vector<int64_t> order;
  for (const bool success : {false, true})
    for (const StoredTrial& trial : trials)
      if (trial.record.success() == success) order.push_back(trial.trial);
  return order;
}

// What pictures of the trials need, for each scenario that occurs, of which the first trial stands
// for all; and stored series, failures first, with a note of which trials.
void AddPictures(const std::vector<StoredTrial>& trials, StoredTrials* stored, Page* page) {
  Json& model = page->model;
  for (const StoredTrial& trial : trials)
    if (const std::string name = ScenarioNameOf(trial);
        stored->plan() && !model["models"].contains(name))
      model["models"][name] = stored->PictureModel(trial);
  for (const int64_t trial : InOrderOfInterest(trials))
    if (stored->Pack(trial, fmt::format("series-{}", trial)))
      model["series_trials"].push_back(trial);
  model["series_stored"] = stored->count();
  for (const auto& [name, trial] : model["models"].items())
    page->has_3d |= !page->parts.empty() && !trial["scene"].is_null();
}

}  // namespace

Page BatchPage(const batch::ResultStore& store, const std::string& file,
               const BatchPageOptions& options) {
  const batch::StoreHeader& header = store.header();
  const std::vector<StoredTrial> trials = store.Trials();
  Page page;
  Json& model = page.model;
  model = {{"kind", "batch"},
           {"kind_title", header.kind == "batch"  ? "batch"
                          : header.kind == "tune" ? "tuning study: its trials"
                                                  : header.kind + ": its trials"},
           {"build", header.build},
           {"file", file},
           {"store_kind", header.kind},
           {"rows", trials.size()},
           {"columns", ColumnsOf(trials)},
           {"parameters", ParametersOf(header.keys, trials)},
           {"models", Json::object()},
           {"series_trials", Json::array()},
           {"series_stored", 0},
           {"missing", Json::array()}};
  StoredTrials stored(store, file, "", options.series_bytes, options.plugins, &page);
  if (const std::optional<batch::Plan>& plan = stored.plan())
    for (const batch::GridAxis& axis : plan->grid()) model["grid"].push_back(axis.key);
  if (header.kind == "batch") AddPictures(trials, &stored, &page);
  const batch::BatchSummary summary = batch::SummaryOf(store, file, options.report);
  model["report"] = report::Document(batch::ReportOf(summary), Json::object())["report"];
  model["title"] = summary.title;
  for (const Json& sentence : model["report"]["missing"]) model["missing"].push_back(sentence);
  return page;
}

Page StoredTrialPage(const batch::ResultStore& store, const std::string& file, int64_t number,
                     const trial::Plugins& plugins) {
  const StoredTrial trial = store.Trial(number);
  const batch::StoreHeader& header = store.header();
  if (header.kind != "batch")
    throw ConfigError(
        fmt::format("{}: was written by {}: one of its trials cannot be shown", file, header.kind));
  const batch::Plan plan(header.plan, file, {.plugins = plugins});
  Page page =
      TrialPage(plan.ScenarioOf(plan.Trial(number)),
                {.record = trial.record,
                 .series = store.SeriesOf(number),
                 .commands = {{{"what", "The trial again, with film and all files"},
                               {"command", fmt::format("turbidock replay {} {}", file, number)}}}});
  page.model["build"] = header.build;
  if (page.model["series"]["time_s"].empty())
    page.model["missing"].push_back(
        "No traces and no replay: the batch stored no series (series_every_frames in its plan)");
  return page;
}

}  // namespace turbidock::page
