#include "experiments/page/study_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "experiments/config/data_files.h"
#include "experiments/page/trial_model.h"
#include "experiments/page/trial_page.h"
#include "experiments/system/output_path.h"

namespace turbidock::page {
namespace {

namespace fs = std::filesystem;
using report::Json;

// A kind of result and the keys by which it is known.
struct Kind {
  const char* name;
  const char* title;
  std::vector<const char*> keys;
};
const std::vector<Kind>& Kinds() {
  static const std::vector<Kind> kinds = {
      {"gate", "gate", {"verdict", "conditions"}},
      {"estimators", "comparison of estimators", {"cells", "fitness_bins"}},
      {"recognition", "recognition experiment", {"cells"}}};
  return kinds;
}

// Integers that a JavaScript number cannot hold become text.
void KeepDigits(Json* json) {
  constexpr int64_t kLargest = int64_t{1} << 53;
  if (json->is_number_integer()) {
    const auto value = json->get<int64_t>();
    if (value > kLargest || value < -kLargest) *json = std::to_string(value);
  } else if (json->is_structured()) {
    for (Json& inner : *json) KeepDigits(&inner);
  }
}

std::string TitleOf(const Json& result, const Kind& kind) {
  if (std::string text = result.value("description", ""); !text.empty()) return text;
  return kind.title;
}

// The published tables, by marker, where the program's data has them.
Json PublishedTables() {
  Json tables = Json::object();
  for (const char* marker : {"active", "passive"}) {
    const std::string file = config::AssetPath(fmt::format("recognition_{}.csv", marker));
    tables[marker] = TableModel(system::ReadWhole(file), file);
  }
  return tables;
}

bool HasFile(const std::string& folder, const char* name) {
  std::error_code none;
  return fs::is_regular_file(fs::path(folder) / name, none);
}

// The trials that the gate ran again for the newly failing seeds.
void AddFailures(const fs::path& folder, const trial::Plugins& plugins, Page* page) {
  page->model["failures"] = Json::array();
  std::vector<fs::path> bundles;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder / "failures", none))
    if (HasFile(entry.path().string(), "result.json")) bundles.push_back(entry.path());
  std::sort(bundles.begin(), bundles.end());
  for (const fs::path& bundle : bundles) {
    const std::string name = bundle.filename().string();
    try {
      Page trial = TrialPage(bundle.string(), plugins);
      page->model["failures"].push_back(
          {{"name", name},
           {"seed", trial.model["seed"]},
           {"outcome", trial.model["record"]["outcome"]},
           {"reason", trial.model["record"]["reason"]},
           {"command", fmt::format("turbidock run {} --out replay --video",
                                   (bundle / "resolved.yaml").string())}});
      page->parts["trial-" + name] = report::JsonLine(trial.model);
      page->has_3d |= trial.has_3d;
    } catch (const ConfigError& error) {
      page->model["missing"].push_back(error.what());
    }
  }
}

}  // namespace

Page StudyPage(const Json& result, const std::string& where) {
  const auto kind = std::find_if(Kinds().begin(), Kinds().end(), [&](const Kind& k) {
    return result.is_object() && std::all_of(k.keys.begin(), k.keys.end(),
                                             [&](const char* key) { return result.contains(key); });
  });
  if (kind == Kinds().end()) {
    throw ConfigError(where + ": is no result of this program");
  }
  Page page;
  page.model = {{"kind", kind->name},
                {"kind_title", kind->title},
                {"title", TitleOf(result, *kind)},
                {"build", result.value("build", result.value("version", ""))},
                {"result", result},
                {"missing", Json::array()}};
  KeepDigits(&page.model["result"]);
  if (page.model["kind"] == "recognition") page.model["published"] = PublishedTables();
  return page;
}

bool IsStudyFolder(const std::string& folder) {
  return HasFile(folder, "summary.json") || HasFile(folder, "report.json");
}

Page StudyFolderPage(const std::string& folder, const trial::Plugins& plugins) {
  const bool is_gate = HasFile(folder, "summary.json");
  const std::string file = (fs::path(folder) / (is_gate ? "summary.json" : "report.json")).string();
  Page page = StudyPage(report::ParseJson(system::ReadWhole(file), file), file);
  if (is_gate) AddFailures(folder, plugins, &page);
  return page;
}

}  // namespace turbidock::page
