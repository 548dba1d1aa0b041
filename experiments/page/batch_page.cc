#include "experiments/page/batch_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "experiments/batch/success_charts.h"
#include "experiments/batch/summary.h"
#include "experiments/page/trial_page.h"
#include "experiments/report/report_json.h"
#include "experiments/system/plain_text.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/trial_view.h"

namespace turbidock::page {
namespace {

using batch::StoredTrial;
using report::Json;

// Of stored series, of which a page should hold many: a tenth of a millimetre at a metre.
constexpr int kStoredDigits = 4;

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

// The trial again; its number comes behind.
std::string ReplayOf(const std::string& file, const trial::Plugins& plugins) {
  return plugins.program() + " replay " + system::ShellWord(file);
}

// What is shown beside the name of a failure.
Json MeaningsOf() {
  Json meanings = Json::object();
  for (const auto& [failure, name] : EnumNames<trial::Failure>::kNames)
    meanings[name] = batch::MeaningOf(failure);
  return meanings;
}

}  // namespace

Page BatchPage(const batch::ResultStore& store, const std::string& file,
               const BatchPageOptions& options) {
  const batch::StoreHeader& header = store.header();
  const std::vector<StoredTrial> trials = store.Trials();
  Page page;
  Json& model = page.model;
  const batch::BatchSummary summary = batch::SummaryOf(store, file, options.report);
  model = report::Document(batch::ReportOf(summary), Json::object())["report"];
  model.update({{"kind", "batch"},
                {"kind_title", header.kind == "batch" ? "batch" : header.kind + ": its trials"},
                {"replay", header.is_of_plan() ? Json(ReplayOf(file, options.plugins)) : Json()},
                {"meanings", MeaningsOf()},
                {"success", batch::ChartsOf(header, trials)},
                {"rows", trials.size()},
                {"columns", ColumnsOf(trials)},
                {"parameters", ParametersOf(header.keys, trials)},
                {"names", Json::object()},
                {"series_trials", Json::array()}});
  for (const char* of : {"columns", "parameters"})
    for (const auto& [key, values] : model[of].items()) model["names"][key] = batch::NameOfKey(key);
  StoredTrials stored(store, file, "", options.series_bytes, options.plugins, &page);
  if (stored.plan() && !trials.empty())
    model["limits"] =
        trial::CriteriaOf(stored.plan()->ScenarioOf(stored.plan()->Trial(trials[0].trial)));
  for (const bool success : {false, true})
    for (const StoredTrial& trial : trials)
      if (trial.record.success() == success && stored.Pack(trial))
        model["series_trials"].push_back(trial.trial);
  model["series_stored"] = stored.count();
  return page;
}

StoredTrials::StoredTrials(const batch::ResultStore& store, std::string file, std::string name,
                           int64_t series_bytes, const trial::Plugins& plugins, Page* page)
    : store_(store),
      file_(std::move(file)),
      name_(std::move(name)),
      replay_(ReplayOf(file_, plugins)),
      bytes_left_(series_bytes),
      page_(page),
      stored_(store.TrialsWithSeries()) {
  if (!store.header().is_of_plan()) return;
  try {
    plan_.emplace(store.PlanHere(), file_, batch::PlanOverrides{.plugins = plugins});
  } catch (const ConfigError& error) {
    page->model["missing"].push_back(fmt::format(
        "This program does not understand all of the plan of {}: {}", file_, error.what()));
  }
}

std::string StoredTrials::SeriesPart(const batch::StoredTrial& trial) const {
  return fmt::format("series-{}-{}", name_, trial.trial);
}

std::string StoredTrials::ModelPart(const batch::StoredTrial& trial) const {
  const auto at = std::ranges::find(trial.parameters, "scenario", &batch::Parameter::key);
  return fmt::format("model-{}-{}", name_, at == trial.parameters.end() ? "" : at->value);
}

bool StoredTrials::Pack(const batch::StoredTrial& trial) {
  if (!plan_ || bytes_left_ < 0 || !std::ranges::binary_search(stored_, trial.trial)) return false;
  const trial::Scenario scenario = plan_->ScenarioOf(plan_->Trial(trial.trial));
  const std::string text = report::JsonLine(
      TracesModel(store_.SeriesOf(trial.trial), trial::CriteriaOf(scenario), kStoredDigits));
  bytes_left_ -= static_cast<int64_t>(Gzip(text).size()) * 4 / 3;
  if (bytes_left_ < 0) return false;
  page_->parts[SeriesPart(trial)] = text;
  if (page_->parts.contains(ModelPart(trial))) return true;
  const Json model = TrialModel(scenario);
  AddPart(ModelPart(trial), model, /*has_3d=*/!model["scene"].is_null(), page_);
  return true;
}

LinkedTrial StoredTrials::Of(int64_t number) {
  const batch::StoredTrial trial = store_.Trial(number);
  LinkedTrial linked{.title = fmt::format("{}: trial {} of {}", name_, number, file_),
                     .outcome = NameOf(trial.record.outcome),
                     .reason = trial.record.reason,
                     .facts = {{"failure", report::Words(NameOf(trial.record.failure))},
                               {"time", fmt::format("{:.1f} s", trial.record.time_s)}}};
  for (const batch::Parameter& p : trial.parameters) {
    const report::Quantity name = batch::NameOfKey(p.key);
    linked.facts.push_back({name.Title(), batch::ValueText(p.key, p.value), p.key});
  }
  if (store_.header().is_of_plan())
    linked.commands = {{"The trial again, with film and all its files",
                        fmt::format("{} {} --out out/{}{}", replay_, number, name_, number)}};
  if (Pack(trial)) {
    linked.model = ModelPart(trial);
    linked.series = SeriesPart(trial);
  } else {
    const bool is_stored = std::ranges::binary_search(stored_, number);
    linked.note = fmt::format(
        "Its traces {}: the command above makes them.",
        is_stored ? "are not in this page" : "were not stored (series_every_frames in the plan)");
  }
  return linked;
}

}  // namespace turbidock::page
