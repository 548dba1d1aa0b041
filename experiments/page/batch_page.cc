#include "experiments/page/batch_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/farm/plan.h"
#include "experiments/farm/run_lock.h"
#include "experiments/farm/trial_scheduler.h"
#include "experiments/page/compress.h"
#include "experiments/page/study_page.h"
#include "experiments/page/trial_model.h"
#include "experiments/report/table.h"
#include "experiments/trial/record_columns.h"

namespace turbidock::page {
namespace {

using farm::StoredTrial;
using report::Json;

// Of stored series, of which a page should hold many: a tenth of a millimetre at a metre.
constexpr int kStoredDigits = 4;

// A column of a table of trials: numbers as a list; words, of which few differ, as a list of them
// and a number for each row.
Json Packed(const std::vector<Json>& values) {
  if (std::none_of(values.begin(), values.end(), [](const Json& v) { return v.is_string(); })) {
    Json list = Json::array();
    for (const Json& value : values)
      list.push_back(Rounded(value));
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

std::string ScenarioNameOf(const StoredTrial& trial) {
  for (const farm::Parameter& p : trial.parameters)
    if (p.key == "scenario") return p.value;
  return "";
}

// What pictures of the trials need, for each scenario that occurs; the first trial stands for all
// of its scenario.
Json ModelsOf(const farm::Plan& plan, const std::vector<StoredTrial>& trials) {
  Json models = Json::object();
  for (const StoredTrial& trial : trials) {
    const std::string name = ScenarioNameOf(trial);
    if (models.contains(name)) continue;
    Json model = TrialModel(plan.ScenarioOf(plan.Trial(trial.trial)));
    model.erase("settings");
    models[name] = model;
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

// Packs the stored series of these trials as parts PREFIX-TRIAL, as many as fit into the bytes, and
// notes in `model` which, and how many the file has.
void AddSeries(const farm::ResultStore& store, const std::string& prefix,
               const std::vector<int64_t>& order, int64_t bytes, Json* model, Page* page) {
  const std::vector<int64_t> with_series = store.TrialsWithSeries();
  const std::set<int64_t> there(with_series.begin(), with_series.end());
  Json packed = Json::array();
  for (const int64_t trial : order) {
    if (!there.count(trial)) continue;
    const std::string text = report::JsonLine(SeriesModel(store.SeriesOf(trial), kStoredDigits));
    bytes -= static_cast<int64_t>(Gzip(text).size()) * 4 / 3;
    if (bytes < 0) break;
    page->parts[fmt::format("{}-{}", prefix, trial)] = text;
    packed.push_back(trial);
  }
  (*model)["series_trials"] = packed;
  (*model)["series_stored"] = with_series.size();
}

// Of one of two files that are compared, what there is to show of these trials.
Json SideModel(const farm::ResultStore& store, const std::string& file, const std::string& prefix,
               const std::vector<int64_t>& numbers, int64_t bytes, Page* page) {
  std::vector<StoredTrial> trials;
  Json facts = Json::object();
  for (const int64_t number : numbers) {
    const StoredTrial& trial = trials.emplace_back(store.Trial(number));
    Json parameters = Json::array();
    for (const farm::Parameter& p : trial.parameters) parameters.push_back({p.key, p.value});
    facts[std::to_string(number)] = {
        {"scenario", ScenarioNameOf(trial)}, {"outcome", trial.record.outcome},
        {"reason", trial.record.reason},     {"failure", trial.record.failure},
        {"time_s", trial.record.time_s},     {"parameters", parameters}};
  }
  const bool is_batch = store.header().kind == "batch";
  Json side = {{"file", file}, {"trials", facts}, {"can_replay", is_batch}};
  AddSeries(store, prefix, numbers, bytes, &side, page);
  side["models"] = Json::object();
  if (is_batch && !side["series_trials"].empty()) {
    try {
      side["models"] = ModelsOf(farm::Plan(store.header().plan, file), trials);
    } catch (const ConfigError& error) {
      page->model["missing"].push_back(fmt::format(
          "This program does not understand all of the plan of {}: {}", file, error.what()));
    }
  }
  for (const auto& [name, model] : side["models"].items())
    page->has_3d |= !model["scene"].is_null();
  return side;
}

// Of a tuning study's plan, what tells a candidate's cost and its place among the gains' ranges.
Json SearchModel(const config::YamlNode& study) {
  const auto number = [](const config::YamlNode& node, const char* key) {
    const auto value = node.Find(key);
    return value ? report::NumberIn(value->Text().value_or("")).value_or(0) : 0.0;
  };
  const auto text = [](const config::YamlNode& node, const char* key) {
    const auto value = node.Find(key);
    return value ? value->Text().value_or("") : std::string();
  };
  Json objective = Json::array(), gains = Json::array();
  if (const auto terms = study.Find("objective"))
    for (const config::YamlNode& term : terms->Elements())
      objective.push_back({{"metric", text(term, "metric")},
                           {"weight", number(term, "weight")},
                           {"failed", number(term, "failed")}});
  if (const auto ranges = study.Find("gains"))
    for (const config::YamlNode& range : ranges->Elements())
      gains.push_back({{"key", text(range, "key")},
                       {"low", number(range, "low")},
                       {"high", number(range, "high")},
                       {"scale", text(range, "scale")}});
  const auto optimiser = study.Find("optimiser");
  return {{"objective", objective},
          {"gains", gains},
          {"success_at_least", number(study, "success_at_least")},
          {"success_weight", number(study, "success_weight")},
          {"generations", optimiser ? number(*optimiser, "generations") : 0}};
}

}  // namespace

std::string TitleOf(const farm::StoreHeader& header) {
  try {
    const auto description = config::ParseYaml(header.plan, "plan").Find("description");
    return description ? description->Text().value_or(header.kind) : header.kind;
  } catch (const ConfigError&) {
    return header.kind;
  }
}

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
           {"title", TitleOf(header)},
           {"build", header.build},
           {"file", file},
           {"plan_hash", header.plan_hash()},
           {"store_kind", header.kind},
           {"shard", header.shard.Text()},
           {"keys", header.keys},
           {"running", farm::IsLocked(file)},
           {"rows", trials.size()},
           {"columns", ColumnsOf(trials)},
           {"missing", Json::array()}};
  Json parameters = Json::object();
  for (size_t k = 0; k < header.keys.size(); ++k) {
    std::vector<Json> values;
    values.reserve(trials.size());
    for (const StoredTrial& trial : trials) values.push_back(farm::ValueOf(trial.parameters[k]));
    parameters[header.keys[k]] = Packed(values);
  }
  model["parameters"] = parameters;

  const auto without = [&](const std::string& what, const std::string& why) {
    model["missing"].push_back(what + ": " + why);
  };
  if (trials.empty()) without("No trials", "none was stored yet");
  model["models"] = Json::object();
  model["series_trials"] = Json::array();
  model["series_stored"] = 0;
  if (header.kind == "tune") {
    try {
      model["search"] = SearchModel(config::ParseYaml(header.plan, file));
    } catch (const ConfigError&) {
      without("How the search goes", "the study in this file cannot be read");
    }
  }
  if (header.kind == "batch") {
    try {
      const farm::TrialScheduler scheduler = farm::SchedulerOf(store);
      model["wanted"] = scheduler.Expected();
      model["most"] = scheduler.most();
      model["precision"] = farm::RuleOf(header).precision;
      const farm::Plan plan(header.plan, file, {.plugins = options.plugins});
      Json grid = Json::array();
      for (const farm::GridAxis& axis : plan.grid()) grid.push_back(axis.key);
      model["grid"] = grid;
      model["models"] = ModelsOf(plan, trials);
    } catch (const ConfigError& error) {
      without("This program does not understand all of the file's plan", error.what());
    }
    AddSeries(store, "series", InOrderOfInterest(trials), options.series_bytes, &model, &page);
    for (const auto& [name, trial] : model["models"].items())
      page.has_3d |= !page.parts.empty() && !trial["scene"].is_null();
  }
  return page;
}

Page ComparisonPage(const Json& comparison, const ComparedFile& a, const ComparedFile& b,
                    const BatchPageOptions& options) {
  Page page = StudyPage(comparison, "comparison");
  std::vector<int64_t> in_a, in_b;
  for (const Json& group : comparison["groups"])
    for (const char* how : {"lost", "gained"})
      for (const Json& pair : group[how]) {
        in_a.push_back(pair["trial_a"]);
        in_b.push_back(pair["trial_b"]);
      }
  const int64_t bytes = options.series_bytes / 2;
  page.model["sides"] = {{"a", SideModel(a.store, a.name, "series-a", in_a, bytes, &page)},
                         {"b", SideModel(b.store, b.name, "series-b", in_b, bytes, &page)}};
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
