#include "experiments/page/batch_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "experiments/farm/plan.h"
#include "experiments/page/stored_trials.h"
#include "experiments/page/trial_model.h"
#include "experiments/report/report_json.h"
#include "experiments/trial/record_columns.h"

namespace turbidock::page {
namespace {

using farm::StoredTrial;
using report::Json;

// A column of a table of trials: numbers as a list; words, of which few differ, as a list of them
// and a number for each row.
Json Packed(const std::vector<Json>& values) {
  if (std::none_of(values.begin(), values.end(), [](const Json& v) { return v.is_string(); })) {
    Json list = Json::array();
    for (const Json& value : values) list.push_back(Rounded(value));
    return list;
  }
  std::map<std::string, size_t> known;
  Json words = Json::array(), of = Json::array();
  for (const Json& value : values) {
    if (value.is_null()) {
      of.push_back(nullptr);
      continue;
    }
    const std::string word = value.is_string() ? value.get<std::string>() : value.dump();
    const auto [at, is_new] = known.emplace(word, known.size());
    if (is_new) words.push_back(word);
    of.push_back(at->second);
  }
  return {{"words", words}, {"of", of}};
}

bool IsAllNull(const std::vector<Json>& values) {
  return std::all_of(values.begin(), values.end(), [](const Json& v) { return v.is_null(); });
}

// A column of values for each key.
Json ParametersOf(const std::vector<std::string>& keys, const std::vector<StoredTrial>& trials) {
  Json parameters = Json::object();
  for (size_t k = 0; k < keys.size(); ++k) {
    std::vector<Json> values;
    for (const StoredTrial& trial : trials) values.push_back(farm::ValueOf(trial.parameters[k]));
    parameters[keys[k]] = Packed(values);
  }
  return parameters;
}

// Columns of the trials' records that a page shows.
bool IsShown(const trial::Column& column) {
  if (column.place == trial::Place::kLog || column.place == trial::Place::kNowhere) return false;
  return column.name != "digest" && column.name != "seed" && column.name != "docked";
}

Json ColumnsOf(const std::vector<StoredTrial>& trials) {
  const std::vector<trial::Column>& columns = trial::Columns();
  std::vector<std::vector<Json>> values(columns.size());
  std::vector<Json> numbers, cells, samples, seeds;
  for (const StoredTrial& trial : trials) {
    const std::vector<trial::Cell> row = trial::CellsOf(trial.record);
    for (size_t i = 0; i < row.size(); ++i)
      if (IsShown(columns[i])) values[i].push_back(row[i]);
    numbers.push_back(trial.trial);
    cells.push_back(trial.cell);
    samples.push_back(trial.sample);
    seeds.push_back(std::to_string(trial.record.seed));
  }
  Json all = {{"trial", Packed(numbers)},
              {"cell", Packed(cells)},
              {"sample", Packed(samples)},
              {"seed", Packed(seeds)}};
  for (size_t i = 0; i < columns.size(); ++i)
    if (IsShown(columns[i]) && !IsAllNull(values[i])) all[columns[i].name] = Packed(values[i]);
  return all;
}

// What pictures of the trials need, for each scenario that occurs; the first trial stands for all
// of its scenario.
Json ModelsOf(const farm::Plan& plan, const std::vector<StoredTrial>& trials) {
  Json models = Json::object();
  for (const StoredTrial& trial : trials) {
    const std::string name = ScenarioNameOf(trial);
    if (!models.contains(name)) models[name] = PictureModel(plan, trial);
  }
  return models;
}

// Failures first, then the others, each in their order.
std::vector<int64_t> InOrderOfInterest(const std::vector<StoredTrial>& trials) {
  std::vector<int64_t> order;
  for (const bool success : {false, true})
    for (const StoredTrial& trial : trials)
      if (trial.record.success() == success) order.push_back(trial.trial);
  return order;
}

// Packs stored series, failures first, and notes of which trials.
void AddSeries(const farm::ResultStore& store, const std::vector<StoredTrial>& trials,
               int64_t bytes, Page* page) {
  Json& model = page->model;
  SeriesPacker series(store, bytes, page);
  for (const int64_t trial : InOrderOfInterest(trials))
    if (series.Pack(trial, fmt::format("series-{}", trial)))
      model["series_trials"].push_back(trial);
  model["series_stored"] = series.stored();
  for (const auto& [name, trial] : model["models"].items())
    page->has_3d |= !page->parts.empty() && !trial["scene"].is_null();
}

}  // namespace

Page BatchPage(const farm::ResultStore& store, const std::string& file,
               const BatchPageOptions& options) {
  const farm::StoreHeader& header = store.header();
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
           {"series_stored", 0}};
  farm::BatchReportOptions report = options.report;
  std::vector<std::string> missing;
  if (header.kind == "batch") {
    try {
      const farm::Plan plan(header.plan, file, {.plugins = options.plugins});
      if (report.by.empty() && report.over.empty()) report = farm::ByGrid(plan);
      for (const farm::GridAxis& axis : plan.grid()) model["grid"].push_back(axis.key);
      model["models"] = ModelsOf(plan, trials);
    } catch (const ConfigError& error) {
      missing.push_back(
          fmt::format("This program does not understand all of the file's plan: {}", error.what()));
    }
    AddSeries(store, trials, options.series_bytes, &page);
  }
  const farm::BatchSummary summary = farm::SummaryOf(store, file, report);
  model["report"] = report::Document(farm::ReportOf(summary), Json::object())["report"];
  model["title"] = summary.title;
  model["missing"] = model["report"]["missing"];
  for (const std::string& sentence : missing) model["missing"].push_back(sentence);
  return page;
}

Page StoredTrialPage(const farm::ResultStore& store, const std::string& file, int64_t number,
                     const trial::Plugins& plugins) {
  const StoredTrial trial = store.Trial(number);
  const farm::StoreHeader& header = store.header();
  if (header.kind != "batch")
    throw ConfigError(
        fmt::format("{}: was written by {}: one of its trials cannot be shown", file, header.kind));
  const farm::Plan plan(header.plan, file, {.plugins = plugins});
  Page page;
  Json& model = page.model;
  model = TrialModel(plan.ScenarioOf(plan.Trial(number)));
  model["build"] = header.build;
  model["record"] = trial.record;
  model["series"] = SeriesModel(store.SeriesOf(number));
  model["frames"] = Json::array();
  if (model["series"]["time_s"].empty())
    model["missing"].push_back(
        "No traces and no replay: the batch stored no series (series_every_frames in its plan)");
  model["commands"] = {{{"what", "The trial again, with film and all files"},
                        {"command", fmt::format("turbidock replay {} {}", file, number)}}};
  page.has_3d = !model["scene"].is_null();
  return page;
}

}  // namespace turbidock::page
