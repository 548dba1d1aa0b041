#include "experiments/page/stored_trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "experiments/batch/summary.h"
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

std::string StoredTrials::SeriesPart(const batch::StoredTrial& trial) const {
  return fmt::format("series-{}-{}", name_, trial.trial);
}

std::string StoredTrials::ModelPart(const batch::StoredTrial& trial) const {
  const auto at = std::ranges::find(trial.parameters, "scenario", &batch::Parameter::key);
  return fmt::format("model-{}-{}", name_, at == trial.parameters.end() ? "" : at->value);
}

bool StoredTrials::Pack(const batch::StoredTrial& trial) {
  if (!plan_ || bytes_left_ < 0 || !std::ranges::binary_search(stored_, trial.trial)) return false;
  const std::string text = report::JsonLine(Rounded(store_.SeriesOf(trial.trial), kStoredDigits));
  bytes_left_ -= static_cast<int64_t>(Gzip(text).size()) * 4 / 3;
  if (bytes_left_ < 0) return false;
  page_->parts[SeriesPart(trial)] = text;
  if (page_->parts.contains(ModelPart(trial))) return true;
  Json model = TrialModel(plan_->ScenarioOf(plan_->Trial(trial.trial)));
  model.erase("settings");
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
  if (store_.header().kind == "batch")
    linked.commands = {
        {"The trial again, with film and all its files",
         fmt::format("turbidock replay {} {} --out out/{}{}", file_, number, name_, number)}};
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
