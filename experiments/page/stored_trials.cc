#include "experiments/page/stored_trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "experiments/page/trial_model.h"
#include "experiments/report/quantity.h"

namespace turbidock::page {
namespace {

using report::Json;

// Of stored series, of which a page should hold many: a tenth of a millimetre at a metre.
constexpr int kStoredDigits = 4;

}  // namespace

StoredTrials::StoredTrials(const batch::ResultStore& store, std::string file, std::string name,
                           int64_t series_bytes, const trial::Plugins& plugins, Page* page)
    : store_(store),
      file_(std::move(file)),
      name_(std::move(name)),
      bytes_left_(series_bytes),
      page_(page),
      stored_(store.TrialsWithSeries()) {
  if (store.header().kind != "batch") return;
  try {
    plan_.emplace(store.header().plan, file_, batch::PlanOverrides{.plugins = plugins});
  } catch (const ConfigError& error) {
    page->model["missing"].push_back(fmt::format(
        "This program does not understand all of the plan of {}: {}", file_, error.what()));
  }
}

bool StoredTrials::Pack(int64_t trial, const std::string& part) {
  if (bytes_left_ < 0 || !std::ranges::binary_search(stored_, trial)) return false;
  const std::string text = report::JsonLine(SeriesModel(store_.SeriesOf(trial), kStoredDigits));
  bytes_left_ -= static_cast<int64_t>(Gzip(text).size()) * 4 / 3;
  if (bytes_left_ < 0) return false;
  page_->parts[part] = text;
  return true;
}

Json StoredTrials::PictureModel(const batch::StoredTrial& trial) const {
  Json model = TrialModel(plan_->ScenarioOf(plan_->Trial(trial.trial)));
  model.erase("settings");
  return model;
}

std::string ScenarioNameOf(const batch::StoredTrial& trial) {
  const auto at = std::ranges::find(trial.parameters, "scenario", &batch::Parameter::key);
  return at == trial.parameters.end() ? "" : at->value;
}

std::string StoredTrials::ModelPart(const batch::StoredTrial& trial) {
  const std::string part = fmt::format("model-{}-{}", name_, ScenarioNameOf(trial));
  if (!page_->parts.contains(part)) {
    const Json model = PictureModel(trial);
    AddPart(part, model, /*has_3d=*/!model["scene"].is_null(), page_);
  }
  return part;
}

LinkedTrial StoredTrials::Of(int64_t number) {
  const batch::StoredTrial trial = store_.Trial(number);
  LinkedTrial linked{.title = fmt::format("{}: trial {} of {}", name_, number, file_),
                     .outcome = NameOf(trial.record.outcome),
                     .reason = trial.record.reason,
                     .facts = {{"failure", report::Words(NameOf(trial.record.failure))},
                               {"time", fmt::format("{:.1f} s", trial.record.time_s)}}};
  for (const batch::Parameter& p : trial.parameters) {
    const std::optional<double> value = report::NumberIn(p.value);
    linked.facts.push_back({p.key, value ? report::Digits(*value) : p.value});
  }
  if (store_.header().kind == "batch")
    linked.commands = {
        {"The trial again, with film and all its files",
         fmt::format("turbidock replay {} {} --out out/{}{}", file_, number, name_, number)}};
  const std::string part = fmt::format("series-{}-{}", name_, number);
  if (plan_ && Pack(number, part)) {
    linked.model = ModelPart(trial);
    linked.series = part;
  } else if (!std::ranges::binary_search(stored_, number)) {
    linked.note =
        "Its traces were not stored (series_every_frames in the plan): replay makes them.";
  } else {
    linked.note =
        fmt::format("Its traces are not in this page: turbidock report {} --trial {} shows them.",
                    file_, number);
  }
  return linked;
}

}  // namespace turbidock::page
